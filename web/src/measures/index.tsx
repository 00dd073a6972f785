/** Measures over the stages, attribution, and the table of vertebrae. */
export { AttributionPanel } from "./attribution-panel";
export { MeasuresPanel } from "./measures-panel";
export { VertebraTable } from "./vertebra-table";
