/** The keys of an image view. */
import type { Vec2 } from "./vectors";

export type KeyAction =
  | { kind: "pan"; by: Vec2 }
  | { kind: "nudge"; by: Vec2 }
  | { kind: "zoom"; factor: number }
  | { kind: "step"; by: 1 | -1 }
  | { kind: "fit" | "frame" | "centre" | "leave" | "remove" | "add" | "details" };

export interface Pressed {
  key: string;
  shiftKey: boolean;
  ctrlKey: boolean;
  metaKey: boolean;
  altKey: boolean;
}

const PAN_PX = 48;
const ZOOM = 1.25;
/** Steps of a ball centre, px: fine, and with the shift key. */
export const FINE_STEP = 0.1;
const COARSE_STEP = 1;

const ARROWS: Readonly<Record<string, Vec2>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** What a key does; null for a key that is not for the view. */
export function keyAction(event: Pressed, movesCentre: boolean): KeyAction | null {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  const arrow = ARROWS[event.key];
  if (arrow !== undefined) {
    const step = event.shiftKey ? COARSE_STEP : FINE_STEP;
    if (movesCentre) return { kind: "nudge", by: [arrow[0] * step, arrow[1] * step] };
    return { kind: "pan", by: [-arrow[0] * PAN_PX, -arrow[1] * PAN_PX] };
  }
  switch (event.key) {
    case "+":
    case "=":
      return { kind: "zoom", factor: ZOOM };
    case "-":
      return { kind: "zoom", factor: 1 / ZOOM };
    case "0":
      return { kind: "fit" };
    case "b":
      return { kind: "frame" };
    case "n":
      return { kind: "step", by: 1 };
    case "p":
      return { kind: "step", by: -1 };
    case "c":
      return { kind: "centre" };
    case "a":
      return { kind: "add" };
    case "Delete":
    case "Backspace":
      return { kind: "remove" };
    case "Enter":
    case " ":
      return { kind: "details" };
    case "Escape":
      return { kind: "leave" };
    default:
      return null;
  }
}
