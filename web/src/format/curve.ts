/** Apex and side of a curve as text. */
import type { Curve } from "../api/types";

/** Return the apex and the side of a curve, or that they are not known. */
export function apexAndSide({ apex, side }: Curve): string {
  const where = apex === null ? "no vertebra between them" : `apex ${apex}`;
  return `${where}, ${side === null ? "side of the convexity not known" : `convex to the ${side}`}`;
}
