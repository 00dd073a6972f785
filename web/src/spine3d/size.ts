/** Nominal sizes of vertebral bodies, for drawing only; the same as `exports/vertebra_size.py`. */
import type { Vec3 } from "./vectors";

const FIRST: Readonly<Record<string, number>> = { C: 0, T: 7, L: 19, S: 24 };
const KNOTS = [0, 7, 12, 18, 21, 24, 29];
const DEPTH_MM = [15, 18, 25, 31, 34, 34, 12];
const WIDTH_MM = [18, 28, 26, 38, 45, 50, 20];
const HEIGHT_MM = [13, 16, 19, 24, 27, 28, 15];

/** Depth (along the vertebra's x), width (y) and height (z) of a vertebra's body, mm. */
export function bodySize(vertebra: string): Vec3 {
  const place = Math.min((FIRST[vertebra.charAt(0)] ?? 7) + Number(vertebra.slice(1)) - 1, 29);
  return [interpolated(place, DEPTH_MM), interpolated(place, WIDTH_MM), interpolated(place, HEIGHT_MM)];
}

function interpolated(place: number, values: readonly number[]): number {
  const after = Math.max(1, KNOTS.findIndex((knot) => knot >= place));
  const [x0 = 0, x1 = 1] = [KNOTS[after - 1], KNOTS[after]];
  const [y0 = 0, y1 = 0] = [values[after - 1], values[after]];
  return y0 + ((y1 - y0) * (place - x0)) / (x1 - x0);
}
