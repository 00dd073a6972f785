/** Triads in the frame of the spine: balls, legs and frames. */
import type { StageSpine, Triad } from "../api/types";
import { type Place, placeBetween } from "./bodies";
import { quaternionOf } from "./rotations";
import { add, apply, type Mat3, matrixOf, mix, multiply, type Vec3, vectorOf } from "./vectors";

export interface DrawnBall {
  readonly name: string;
  readonly position: Vec3;
  /** Whether both cameras saw it. */
  readonly inBoth: boolean;
}

export interface DrawnTriad {
  /** The vertebra; null when it is not certain. */
  readonly label: string | null;
  /** P and the frame; null when the triad has no pose. */
  readonly place: Place | null;
  readonly balls: readonly DrawnBall[];
}

/** Why the triads of a stage cannot be drawn beside its spine. */
export const NO_TRANSFORM =
  "This spine was computed by an earlier version, which does not say where the triads are in its frame. Save the spine's setup with a change to compute it again.";

/** The triads of a stage in the frame of its spine; null when the spine does not say how they lie in it. */
export function triadsOf(spine: StageSpine, triads: readonly Triad[]): DrawnTriad[] | null {
  const R = matrixOf(spine.object_to_spine?.rotation);
  const t = vectorOf(spine.object_to_spine?.translation_mm);
  if (R === null || t === null) return null;
  return triads.map((triad) => ({
    label: triad.label,
    place: placeIn(R, t, triad),
    balls: Object.entries(triad.balls).flatMap(([name, ball]): DrawnBall[] => {
      const position = vectorOf(ball.position_mm);
      if (position === null) return [];
      return [{ name, position: add(apply(R, position), t), inBoth: ball.left !== null && ball.right !== null }];
    }),
  }));
}

/** The labelled triads at a fraction of the way from one stage to another; only those that both have lie between. */
export function triadsBetween(
  from: readonly DrawnTriad[],
  to: readonly DrawnTriad[],
  fraction: number,
): readonly DrawnTriad[] {
  if (fraction <= 0) return from;
  if (fraction >= 1) return to;
  return to.flatMap((triad): DrawnTriad[] => {
    const start = from.find((other) => triad.label !== null && other.label === triad.label);
    if (start === undefined) return [];
    const balls = triad.balls.flatMap((ball): DrawnBall[] => {
      const before = start.balls.find((other) => other.name === ball.name);
      if (before === undefined) return [];
      return [{ ...ball, position: mix(before.position, ball.position, fraction), inBoth: before.inBoth && ball.inBoth }];
    });
    const place = start.place && triad.place ? placeBetween(start.place, triad.place, fraction) : null;
    return [{ label: triad.label, place, balls }];
  });
}

function placeIn(R: Mat3, t: Vec3, triad: Triad): Place | null {
  const position = vectorOf(triad.position_mm);
  const rotation = matrixOf(triad.rotation);
  if (position === null || rotation === null) return null;
  return { position: add(apply(R, position), t), rotation: quaternionOf(multiply(R, rotation)) };
}
