/** One row for each vertebra: its motion since an earlier stage, in patient axes, with deviations, status and flags. */
import type { Flag, StageSpine, VertebraChange } from "../api/types";
import type { Status } from "../format/status";
import type { Cell } from "./table-text";

export type ColumnKey = "x" | "y" | "z" | "derotation" | "coronal" | "sagittal" | "distraction";

export interface Column {
  readonly key: ColumnKey;
  readonly name: string;
  readonly unit: "mm" | "deg";
  /** What a positive value means. */
  readonly positive: string;
}

export const COLUMNS: readonly Column[] = [
  { key: "x", name: "Translation x", unit: "mm", positive: "anterior" },
  { key: "y", name: "Translation y", unit: "mm", positive: "left" },
  { key: "z", name: "Translation z", unit: "mm", positive: "cephalad" },
  { key: "derotation", name: "Derotation", unit: "deg", positive: "front to the left" },
  { key: "coronal", name: "Coronal change", unit: "deg", positive: "left side up" },
  { key: "sagittal", name: "Sagittal change", unit: "deg", positive: "leans forwards" },
  { key: "distraction", name: "Distraction", unit: "mm", positive: "longer" },
];

export interface Measured {
  readonly value: number | null;
  readonly sd: number | null;
}

export interface VertebraRow {
  readonly vertebra: string;
  /** Its place, 0 for the most cranial. */
  readonly order: number;
  readonly status: Status;
  /** Whether its own marker was measured at the stage. */
  readonly marked: boolean;
  /** Whether the frame is fixed to it, so that it has no motion. */
  readonly isReference: boolean;
  readonly reason: string | null;
  readonly values: Readonly<Record<ColumnKey, Measured>>;
  readonly flags: readonly Flag[];
}

export type SortKey = ColumnKey | "vertebra" | "status" | "flags";
export interface Sorting {
  readonly key: SortKey;
  readonly descending: boolean;
}

export const ANATOMICAL: Sorting = { key: "vertebra", descending: false };

const CERTAINTY: Readonly<Record<Status, number>> = { measured: 0, interpolated: 1, bracketed: 2, assumed: 3, not_measured: 4 };

/** Return the rows of a motion; `flags` are those of the stage and of its spine. */
export function vertebraRows(spine: StageSpine, changes: readonly VertebraChange[], flags: readonly Flag[]): VertebraRow[] {
  return changes.map((change, order) => ({
    ...placeOf(spine, change.vertebra),
    vertebra: change.vertebra,
    order,
    status: change.origin,
    reason: change.reason,
    values: valuesOf(change),
    flags: flagsOf(change.vertebra, flags),
  }));
}

/** Return the rows of a stage that has no earlier one: its vertebrae without a motion. */
export function rowsWithoutMotion(spine: StageSpine, reason: string, flags: readonly Flag[]): VertebraRow[] {
  const nothing: Measured = { value: null, sd: null };
  return spine.vertebrae.map((state, order) => ({
    ...placeOf(spine, state.vertebra),
    vertebra: state.vertebra,
    order,
    status: state.origin,
    reason,
    values: Object.fromEntries(COLUMNS.map(({ key }) => [key, nothing])) as Record<ColumnKey, Measured>,
    flags: flagsOf(state.vertebra, flags),
  }));
}

/** Return the flags that name a vertebra. */
export function flagsOf(vertebra: string, flags: readonly Flag[]): Flag[] {
  const name = new RegExp(`(^|[^A-Za-z0-9])${vertebra}([^A-Za-z0-9]|$)`);
  return flags.filter((flag) => name.test(flag.detail));
}

/** Return the rows in another order; rows without the value come last, and equal ones stay in anatomical order. */
export function sorted(rows: readonly VertebraRow[], { key, descending }: Sorting): VertebraRow[] {
  const sign = descending ? -1 : 1;
  return [...rows].sort((one, other) => {
    const [a, b] = [sortValue(one, key), sortValue(other, key)];
    if (a === null || b === null) return (a === null ? 1 : 0) - (b === null ? 1 : 0) || one.order - other.order;
    return sign * (a - b) || one.order - other.order;
  });
}

/** Return the order after a press on a header: ascending, descending, then anatomical again. */
export function nextSorting(now: Sorting, key: SortKey): Sorting {
  if (now.key !== key) return { key, descending: false };
  if (key !== "vertebra" && now.descending) return ANATOMICAL;
  return { key, descending: !now.descending };
}

/** Header and rows for copying, full precision, in the order that is shown. */
export function vertebraTable(rows: readonly VertebraRow[]): { header: string[]; rows: Cell[][] } {
  const header = ["vertebra", "status", "own_marker", ...COLUMNS.flatMap(({ key, unit }) => [`${key}_${unit}`, `${key}_sd_${unit}`]), "flags", "reason"];
  const cells = rows.map((row) => [
    row.vertebra,
    row.status,
    row.marked,
    ...COLUMNS.flatMap(({ key }) => [row.values[key].value, row.values[key].sd]),
    row.flags.map((flag) => flag.code).join(" "),
    row.reason,
  ]);
  return { header, rows: cells };
}

function placeOf(spine: StageSpine, vertebra: string): Pick<VertebraRow, "marked" | "isReference"> {
  const state = spine.vertebrae.find((one) => one.vertebra === vertebra);
  return { marked: state?.marked ?? false, isReference: vertebra === spine.reference_vertebra };
}

function sortValue(row: VertebraRow, key: SortKey): number | null {
  if (key === "vertebra") return row.order;
  if (key === "status") return CERTAINTY[row.status];
  if (key === "flags") return -row.flags.length;
  return row.values[key].value;
}

function valuesOf(change: VertebraChange): Record<ColumnKey, Measured> {
  const [x = null, y = null, z = null] = change.translation_mm;
  const [xSd = null, ySd = null, zSd = null] = change.translation_sd_mm;
  return {
    x: { value: x, sd: xSd },
    y: { value: y, sd: ySd },
    z: { value: z, sd: zSd },
    derotation: { value: change.derotation_deg, sd: change.derotation_sd_deg },
    coronal: { value: change.coronal_deg, sd: change.coronal_sd_deg },
    sagittal: { value: change.sagittal_deg, sd: change.sagittal_sd_deg },
    distraction: { value: change.distraction_mm, sd: change.distraction_sd_mm },
  };
}
