/** The spine in three dimensions. */
export { SpinePanel } from "./spine-panel";
