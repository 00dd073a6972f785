/** What fingers, mouse and keys do to the view. */
import { orbit, pan, type Screen, type View, zoom } from "./views";

export type Point = readonly [number, number];

const DEGREES_PER_PX = 0.4;
const KEY_DEGREES = 7.5;
const KEY_SHARE = 0.05;
const KEY_ZOOM = 1.2;

/** A drag of one pointer by px to the right and down: it turns the spine, or moves it. */
export function dragged(view: View, screen: Screen, dx: number, dy: number, moves: boolean): View {
  if (!moves) return orbit(view, -dx * DEGREES_PER_PX, dy * DEGREES_PER_PX);
  const mmPerPx = view.height / screen.height;
  return pan(view, -dx * mmPerPx, dy * mmPerPx);
}

/** A gesture of two fingers: their distance zooms, their middle moves. Points are px from the upper left corner. */
export function pinched(view: View, screen: Screen, before: readonly [Point, Point], after: readonly [Point, Point]): View {
  const apart = ([a, b]: readonly [Point, Point]): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
  const centre = ([a, b]: readonly [Point, Point]): Point => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  const [from, to] = [centre(before), centre(after)];
  const moved = dragged(view, screen, to[0] - from[0], to[1] - from[1], true);
  const factor = apart(before) > 0 ? apart(after) / apart(before) : 1;
  return factor > 0 ? zoom(moved, factor, screen, fromMiddle(screen, to)) : moved;
}

/** A turn of the wheel by px zooms about the pointer. */
export function wheeled(view: View, screen: Screen, deltaPx: number, at: Point): View {
  return zoom(view, Math.exp(-Math.max(-400, Math.min(400, deltaPx)) / 500), screen, fromMiddle(screen, at));
}

/** A place on the screen, px right of and above its middle. */
function fromMiddle(screen: Screen, [x, y]: Point): Point {
  return [x - screen.width / 2, screen.height / 2 - y];
}

export type Command = "fit" | "above" | "below" | "clear" | "free" | "coronal" | "sagittal" | "top";

const COMMANDS: Readonly<Record<string, Command>> = {
  "0": "fit",
  "1": "free",
  "2": "coronal",
  "3": "sagittal",
  "4": "top",
  PageUp: "above",
  PageDown: "below",
  "[": "above",
  "]": "below",
  Escape: "clear",
};

/** What a key means: another view, a command, or nothing. */
export function keyed(view: View, key: string, shift: boolean): View | Command | null {
  const step = KEY_SHARE * view.height;
  const square: Screen = { width: 1, height: 1 };
  switch (key) {
    case "ArrowLeft":
      return shift ? pan(view, step, 0) : orbit(view, KEY_DEGREES, 0);
    case "ArrowRight":
      return shift ? pan(view, -step, 0) : orbit(view, -KEY_DEGREES, 0);
    case "ArrowUp":
      return shift ? pan(view, 0, -step) : orbit(view, 0, -KEY_DEGREES);
    case "ArrowDown":
      return shift ? pan(view, 0, step) : orbit(view, 0, KEY_DEGREES);
    case "+":
    case "=":
      return zoom(view, KEY_ZOOM, square);
    case "-":
    case "_":
      return zoom(view, 1 / KEY_ZOOM, square);
    default:
      return COMMANDS[key] ?? null;
  }
}

export const KEY_HELP =
  "Arrow keys turn the spine, with Shift they move it. Plus and minus zoom, 0 shows all, 1 to 4 are the fixed views." +
  " Page up and page down select the vertebra above and below, Escape selects none.";
