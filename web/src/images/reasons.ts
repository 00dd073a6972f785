/** Why candidates were rejected, in words. */
import type { CandidateTriad } from "../api/types";
import type { FeatureReason } from "./scene";

type Reason = NonNullable<CandidateTriad["reason"]>;

interface ReasonText {
  title: string;
  text: string;
}

export const TRIAD_REASONS: Readonly<Record<Reason, ReasonText>> = {
  "feature-twice": { title: "Feature used twice", text: "two of its balls are the same feature of an image" },
  "point-taken": { title: "Point taken", text: "shares a matched point with a chosen triad" },
  "feature-taken": { title: "Feature taken", text: "shares a feature of one image with a chosen triad" },
  spacing: { title: "Spacing", text: "its place does not fit the spacing of the chosen chain" },
  count: { title: "Number of triads", text: "as many triads as expected were chosen, and they are more likely together" },
  "too-near": { title: "Too near", text: "nearer to a chosen triad than two markers can be" },
  distances: { title: "Distances", text: "the distances of its balls contradict the marker by their covariance" },
  mirrored: { title: "Mirrored", text: "mirror image of a marker of four balls" },
  tilt: { title: "Tilt", text: "faces away from the cameras" },
  improbable: { title: "Improbable", text: "its own log-odds are too low" },
  "not-considered": { title: "Not considered", text: "less likely than the largest number of candidates considered" },
  removed: { title: "Removed", text: "a person removed it" },
};

export const FEATURE_REASONS: Readonly<Record<FeatureReason, string>> = {
  "no-partner": "no feature of the other image is on its epipolar line",
  "no-triad": "no matched points with it fit a marker",
  rejected: "it fits markers, and all of them were rejected",
};

/** The title and the sentence of a reason; a reason of a later version is shown as it is. */
export function triadReason(reason: Reason): ReasonText {
  return TRIAD_REASONS[reason] ?? { title: reason, text: reason };
}
