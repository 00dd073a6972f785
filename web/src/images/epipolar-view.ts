/** What the page shows for a ball in the other image: its epipolar line, its band, and the features within it. */
import type { Rig } from "./camera";
import { otherSide, type Side } from "./camera";
import {
  candidatesOf,
  distanceFromLine,
  distanceSigma,
  epipolarLine,
  type EpipolarParameters,
  type Ranges,
} from "./epipolar";
import type { Centre } from "./scene";
import type { Symmetric2, Vec2 } from "./vectors";

export interface EpipolarView {
  /** The image in which it is drawn. */
  side: Side;
  line: Vec2[];
  /** Half the width of the band of candidates, px. */
  halfWidth: number;
  /** Keys of the centres within the band and the range of the markers. */
  candidates: string[];
}

/** Covariance of a centre that has none, px²: that of a person's. */
const ASSUMED: Symmetric2 = [0.25, 0, 0.25];

/** The epipolar line of a centre; null when it leaves the other image. */
export function epipolarView(
  rig: Rig,
  limits: Ranges | null,
  parameters: EpipolarParameters,
  centre: Centre,
  others: readonly Centre[],
): EpipolarView | null {
  if (limits === null) return null;
  const line = epipolarLine(rig, centre.side, centre.pixel, limits);
  const middle = line[Math.floor(line.length / 2)];
  if (line.length < 2 || middle === undefined) return null;
  const measured = (of: Centre): { pixel: Vec2; covariance: Symmetric2 } => ({
    pixel: of.pixel,
    covariance: of.covariance ?? ASSUMED,
  });
  const found = candidatesOf(rig, centre.side, measured(centre), others.map(measured), limits, parameters);
  const typical: Symmetric2 = centre.covariance ?? ASSUMED;
  // One pixel beside the line is so many deviations away from it.
  const beside: Vec2 = [middle[0] - normal(line)[0], middle[1] - normal(line)[1]];
  const [own, other] = [measured(centre), { pixel: beside, covariance: typical }];
  const perPixel = Math.abs(
    centre.side === "left"
      ? distanceSigma(rig, own, other, parameters.extraMrad)
      : distanceSigma(rig, other, own, parameters.extraMrad),
  );
  return {
    side: otherSide(centre.side),
    line,
    halfWidth: parameters.toleranceSigma / perPixel,
    candidates: found.flatMap((index) => others[index]?.key ?? []),
  };
}

/** The distance of a centre from the epipolar line of its partner, px; null without one. */
export function distanceToLine(view: EpipolarView | null, centre: Centre | null): number | null {
  return view === null || centre === null || view.side !== centre.side ? null : distanceFromLine(view.line, centre.pixel);
}

function normal(line: readonly Vec2[]): Vec2 {
  const middle = Math.floor(line.length / 2);
  const [a, b] = [line[middle - 1] ?? [0, 0], line[middle] ?? [1, 0]];
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  return [-(b[1] - a[1]) / length, (b[0] - a[0]) / length];
}
