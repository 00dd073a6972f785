/** The pixel spacing of a radiograph as it is typed. */

export type Spacing =
  | { readonly state: "none" }
  | { readonly state: "given"; readonly text: string }
  | { readonly state: "wrong"; readonly reason: string };

const NUMBER = /^[0-9]{1,3}([.,][0-9]{1,12})?$/;

/** Return the spacing as the API takes it, `row,column`, or what is wrong with it. */
export function spacingText(rows: string, columns: string): Spacing {
  const [row, column] = [rows.trim(), columns.trim()];
  if (row === "" && column === "") return { state: "none" };
  if (row === "" || column === "") return { state: "wrong", reason: "Give both distances, or neither." };
  for (const text of [row, column]) {
    if (!NUMBER.test(text) || !(Number(text.replace(",", ".")) > 0)) {
      return { state: "wrong", reason: "Give positive numbers in mm, such as 0.143." };
    }
  }
  return { state: "given", text: [row, column].map((text) => text.replace(",", ".")).join(",") };
}
