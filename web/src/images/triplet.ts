/** A candidate triad as it is drawn over the images. */
import type { CandidateTriad } from "../api/types";
import type { Side } from "./camera";
import type { ShownTriplet } from "./overlay";
import { centreAt, type Scene } from "./scene";
import type { Vec2 } from "./vectors";

/** The keys of the features of a candidate triad. */
export function shownTriplet(candidate: CandidateTriad | null): ShownTriplet | null {
  if (candidate === null) return null;
  const keyOf = (feature: number | null): string | null => (feature === null ? null : `f${feature}`);
  return {
    left: candidate.left.map(keyOf),
    right: candidate.right.map(keyOf),
    balls: candidate.balls,
    chosen: candidate.reason === null,
  };
}

/** The middle of a candidate triad in an image; null when the image does not show it. */
export function middleOf(triplet: ShownTriplet, scene: Scene, side: Side): Vec2 | null {
  const places = triplet[side].flatMap((key) => {
    const centre = centreAt(scene, side, key);
    return centre === null ? [] : [centre.pixel];
  });
  if (places.length === 0) return null;
  const sum = places.reduce((total, place) => [total[0] + place[0], total[1] + place[1]] as Vec2, [0, 0] as Vec2);
  return [sum[0] / places.length, sum[1] / places.length];
}
