/** What keys do in a radiograph. */
import type { Point } from "./landmarks";

export type KeyAction =
  | { readonly type: "move"; readonly by: Point }
  | { readonly type: "place" }
  | { readonly type: "remove" }
  | { readonly type: "skip" }
  | { readonly type: "undo" }
  | { readonly type: "redo" }
  | { readonly type: "next" }
  | { readonly type: "previous" }
  | { readonly type: "zoom"; readonly factor: number }
  | { readonly type: "fit" };

export interface Key {
  readonly key: string;
  readonly shiftKey: boolean;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly altKey: boolean;
}

const ARROWS: Readonly<Record<string, Point>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const ZOOM = 1.25;

/** How far an arrow key moves, px. */
export function stepOf(key: Pick<Key, "shiftKey" | "ctrlKey" | "metaKey">): number {
  const control = key.ctrlKey || key.metaKey;
  if (control) return key.shiftKey ? 100 : 10;
  return key.shiftKey ? 1 : 0.1;
}

/** What a key does; null for keys that mean nothing here. */
export function actionOf(key: Key): KeyAction | null {
  const arrow = ARROWS[key.key];
  if (arrow !== undefined && !key.altKey) {
    const step = stepOf(key);
    return { type: "move", by: [arrow[0] * step, arrow[1] * step] };
  }
  if (key.ctrlKey || key.metaKey) {
    if (key.key.toLowerCase() === "z") return { type: key.shiftKey ? "redo" : "undo" };
    return key.key.toLowerCase() === "y" ? { type: "redo" } : null;
  }
  if (key.altKey) return null;
  switch (key.key) {
    case "Enter":
    case " ":
      return { type: "place" };
    case "Delete":
    case "Backspace":
      return { type: "remove" };
    case "s":
      return { type: "skip" };
    case "n":
      return { type: "next" };
    case "p":
      return { type: "previous" };
    case "+":
    case "=":
      return { type: "zoom", factor: ZOOM };
    case "-":
      return { type: "zoom", factor: 1 / ZOOM };
    case "0":
      return { type: "fit" };
    default:
      return null;
  }
}
