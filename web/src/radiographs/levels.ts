/** Names of vertebrae in anatomical order. */

const REGIONS: readonly (readonly [string, number])[] = [
  ["C", 7],
  ["T", 13],
  ["L", 6],
  ["S", 5],
];

/** All names that a spine may have, from the skull down. */
export const ALL_LEVELS: readonly string[] = REGIONS.flatMap(([letter, count]) =>
  Array.from({ length: count }, (_, index) => `${letter}${index + 1}`),
);

const USUAL = new Set([...ALL_LEVELS.filter((name) => !/^(T13|L6|S[2-5])$/.test(name))]);

/** The names of a spine: the usual ones and what a surgery declares besides. */
export function levelsOf(extra: readonly string[] = []): string[] {
  return ALL_LEVELS.filter((name) => USUAL.has(name) || extra.includes(name));
}

/** Names sorted from cranial to caudal; unknown ones last. */
export function cranialFirst(names: readonly string[]): string[] {
  const place = (name: string): number => (ALL_LEVELS.indexOf(name) + 1 || ALL_LEVELS.length + 1);
  return [...names].sort((a, b) => place(a) - place(b));
}

/** All vertebrae from the most cranial to the most caudal of some names. */
export function span(names: readonly string[], extra: readonly string[] = []): string[] {
  const known = levelsOf(extra);
  const places = names.map((name) => known.indexOf(name)).filter((place) => place >= 0);
  return places.length === 0 ? [] : known.slice(Math.min(...places), Math.max(...places) + 1);
}
