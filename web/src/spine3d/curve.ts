/** The spine line: a smooth curve through the centroids. */
import type { Body } from "./bodies";
import { add, scale, subtract, type Vec3 } from "./vectors";

export interface Stretch {
  readonly from: Body;
  readonly to: Body;
  /** Points from one centroid to the next. */
  readonly points: readonly Vec3[];
}

/** Stretches of the curve between neighbours (Catmull and Rom 1974); none across a vertebra without a pose. */
export function spineLine(bodies: readonly Body[], steps = 6): Stretch[] {
  return bodies.slice(1).flatMap((to, k): Stretch[] => {
    const from = bodies[k];
    if (from === undefined || to.order - from.order !== 1) return [];
    const before = adjacent(bodies[k - 1], from, -1) ?? reflect(from.position, to.position);
    const after = adjacent(bodies[k + 2], to, 1) ?? reflect(to.position, from.position);
    const points = Array.from({ length: steps + 1 }, (_, step) =>
      catmullRom(before, from.position, to.position, after, step / steps),
    );
    return [{ from, to, points }];
  });
}

function adjacent(other: Body | undefined, body: Body, step: number): Vec3 | null {
  return other !== undefined && other.order - body.order === step ? other.position : null;
}

function reflect(at: Vec3, point: Vec3): Vec3 {
  return subtract(scale(at, 2), point);
}

function catmullRom(a: Vec3, b: Vec3, c: Vec3, d: Vec3, t: number): Vec3 {
  const [t2, t3] = [t * t, t * t * t];
  const weights = [(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2, (t3 - t2) / 2];
  return [a, b, c, d].reduce<Vec3>((sum, point, k) => add(sum, scale(point, weights[k] ?? 0)), [0, 0, 0]);
}
