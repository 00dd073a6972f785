/** Which files are left and right of which pair, from their names. */

export interface NamedFile {
  readonly name: string;
  /** Path within what was chosen or dropped, with the name: `PRE/left.png`. */
  readonly path: string;
}

/** A pair by the positions of its files; null where there is none yet. */
export interface Pair {
  readonly left: number | null;
  readonly right: number | null;
}

export interface Pairing {
  readonly pairs: readonly Pair[];
  /** Whether the names do not tell left from right, so that the order of the files was taken. */
  readonly guessed: boolean;
}

export type Side = "left" | "right";

const WORDS: Readonly<Record<Side, string>> = {
  left: "left|links|gauche|izquierda",
  right: "right|rechts|droite|derecha",
};
const LETTERS: Readonly<Record<Side, string>> = { left: "l|lt", right: "r|rt" };
const NATURAL = new Intl.Collator("en", { numeric: true });
const STAGE_NAME = /^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$/;

/** Pair files by their names. */
export function pairFiles(files: readonly NamedFile[]): Pairing {
  const sides = files.map(({ path }) => sideOf(path));
  const left = positions(sides, "left");
  const right = positions(sides, "right");
  if (left.length + right.length < files.length || left.length === 0 || right.length === 0) {
    return { pairs: inOrder(files), guessed: files.length > 1 };
  }
  return { pairs: byKey(files, left, right) ?? sideBySide(files, left, right), guessed: false };
}

/** The side that a path names; null when it names none or both. */
export function sideOf(path: string): Side | null {
  // the name of the file counts before those of its folders
  for (const part of path.split("/").reverse()) {
    const stem = part.replace(/\.[A-Za-z0-9]+$/, "").toLowerCase();
    const named = (["left", "right"] as const).filter((side) => pattern(side).test(stem));
    if (named.length === 1) return named[0] ?? null;
  }
  return null;
}

/** A name for the stage: that of the folder, or what the names of the files have in common; empty for none. */
export function stageNameOf(files: readonly NamedFile[]): string {
  const folders = new Set(files.map(({ path }) => folderOf(path)));
  const [folder = ""] = folders;
  if (folders.size === 1 && STAGE_NAME.test(folder)) return folder;
  const stems = new Set(files.map(({ name }) => withoutSide(name).replace(/[\s._-]*\d*$/, "")));
  const [stem = ""] = stems;
  return stems.size === 1 && STAGE_NAME.test(stem) ? stem : "";
}

/** Names of the folders of the files, without those that only name a side. */
export function foldersOf(files: readonly NamedFile[]): string[] {
  return [...new Set(files.map(({ path }) => folderOf(path)))].sort(NATURAL.compare);
}

/** Put a file at a place; the file that was there goes to where that one was. */
export function assign(pairs: readonly Pair[], row: number, side: Side, file: number | null): Pair[] {
  const before = pairs[row]?.[side] ?? null;
  return pairs.map((pair, index) => {
    const moved = {
      left: file !== null && pair.left === file ? before : pair.left,
      right: file !== null && pair.right === file ? before : pair.right,
    };
    return index === row ? { ...moved, [side]: file } : moved;
  });
}

/** Exchange left and right of one pair, or of all. */
export function exchange(pairs: readonly Pair[], row: number | null): Pair[] {
  return pairs.map((pair, index) => (row === null || row === index ? { left: pair.right, right: pair.left } : pair));
}

function positions(sides: readonly (Side | null)[], wanted: Side): number[] {
  return sides.flatMap((side, index) => (side === wanted ? [index] : []));
}

/** Pairs whose names differ in the side only; null unless every file has its other one. */
function byKey(files: readonly NamedFile[], left: readonly number[], right: readonly number[]): Pair[] | null {
  const key = (index: number): string => keyOf(files[index]?.path ?? "");
  const others = new Map(right.map((index) => [key(index), index]));
  const keys = new Set(left.map(key));
  if (left.length !== right.length || keys.size !== left.length || others.size !== right.length) return null;
  if (![...keys].every((one) => others.has(one))) return null;
  return [...left]
    .sort((one, other) => NATURAL.compare(key(one), key(other)))
    .map((index) => ({ left: index, right: others.get(key(index)) ?? null }));
}

/** Pairs of both sides in the order of their names. */
function sideBySide(files: readonly NamedFile[], left: readonly number[], right: readonly number[]): Pair[] {
  const [lefts, rights] = [sorted(files, left), sorted(files, right)];
  return Array.from({ length: Math.max(lefts.length, rights.length) }, (_, row) => ({
    left: lefts[row] ?? null,
    right: rights[row] ?? null,
  }));
}

/** Pairs of files that follow each other by name. */
function inOrder(files: readonly NamedFile[]): Pair[] {
  const order = sorted(files, files.map((_, index) => index));
  return Array.from({ length: Math.ceil(order.length / 2) }, (_, row) => ({
    left: order[2 * row] ?? null,
    right: order[2 * row + 1] ?? null,
  }));
}

function sorted(files: readonly NamedFile[], indices: readonly number[]): number[] {
  const path = (index: number): string => files[index]?.path ?? "";
  return [...indices].sort((one, other) => NATURAL.compare(path(one), path(other)));
}

/** A pattern of a side in a part of a path: its word anywhere, its letter only where no letters are beside it. */
function pattern(side: Side, flags = ""): RegExp {
  return new RegExp(`${WORDS[side]}|(?<![a-z])(?:${LETTERS[side]})(?![a-z])`, flags);
}

function keyOf(path: string): string {
  return path
    .toLowerCase()
    .split("/")
    .map(withoutSide)
    .join("/");
}

function withoutSide(name: string): string {
  const stem = name.replace(/\.[A-Za-z0-9]+$/, "");
  const lower = stem.toLowerCase();
  for (const side of ["left", "right"] as const) {
    const found = pattern(side).exec(lower);
    if (found !== null) return stem.slice(0, found.index) + stem.slice(found.index + found[0].length);
  }
  return stem;
}

function folderOf(path: string): string {
  const folders = path.split("/").slice(0, -1);
  while (folders.length > 0 && withoutSide(folders.at(-1) ?? "") === "") folders.pop();
  return folders.at(-1) ?? "";
}
