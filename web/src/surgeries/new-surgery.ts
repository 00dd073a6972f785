/** What is typed into the form of a new surgery. */

/** The vertebrae in a text, separated by anything but letters and digits: `L1, t11 T9`. */
export function vertebraeOf(text: string): string[] {
  return text
    .toUpperCase()
    .split(/[^A-Z0-9]+/)
    .filter((name) => name !== "");
}

/** The vertebra of reference to suggest: the chosen one while it is there, else the most caudal of the ends. */
export function referenceFor(vertebrae: readonly string[], chosen: string): string {
  if (vertebrae.includes(chosen)) return chosen;
  const [first = "", last = ""] = [vertebrae[0], vertebrae.at(-1)];
  return caudality(last) > caudality(first) ? last : first;
}

function caudality(name: string): number {
  const region = "CTLS".indexOf(name.charAt(0));
  return region * 100 + Number.parseInt(name.slice(1), 10);
}
