/** Tables as text that spreadsheets take: tab-separated values. */

export type Cell = string | number | boolean | null | undefined;

/** Return a table as tab-separated values; an empty cell is one without a value. */
export function tsv(header: readonly string[], rows: readonly (readonly Cell[])[]): string {
  return [header, ...rows].map((row) => row.map(cell).join("\t")).join("\n") + "\n";
}

/** Tabs and line ends would begin another cell; a spreadsheet computes what begins like a formula. */
function cell(value: Cell): string {
  if (value === null || value === undefined) return "";
  if (typeof value === "number") return Number.isFinite(value) ? String(value) : "";
  const text = String(value).replace(/[\t\r\n]+/g, " ");
  return /^[=+\-@]/.test(text) ? `'${text}` : text;
}
