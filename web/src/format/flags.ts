/** How much a flag matters: what is shown first, and in which colour. */
import type { Flag } from "../api/types";

export type Severity = "info" | "warning" | "error";

/** Flags that say that a result is missing or may be far from the truth. */
const ERRORS = [
  "blank-image",
  "no-features",
  "image-damaged",
  "image-negative",
  "triad-incomplete",
  "triad-doubtful",
  "labels-uncertain",
  "calibration-drift",
  "lens-differs",
  "triad-count-high",
  "centre-displaced",
  "marker-doubtful",
  "no-triads",
  "levels-implausible",
  "spine-axis-implausible",
  "frame-repeated",
  "pair-mixed",
  "views-not-synchronous",
  "reference-moved",
  "intervertebral-distance-implausible",
  "intervertebral-rotation-implausible",
  "neighbours-disagree",
  "radiograph-points-disagree",
  "radiograph-axes-differ",
  "patient-axes-doubtful",
  "initial-poses-reversed",
  "rebaseline-moved",
  "initial-levels-shifted",
  "no-redundancy",
  "adjustment-unfinished",
  "calibration-poor",
] as const;

/** Flags that say that a result is less complete or less accurate than it could be. */
const WARNINGS = [
  "image-dark",
  "image-saturated",
  "image-compressed",
  "image-blurred",
  "image-interlaced",
  "image-coarse",
  "image-noisy",
  "exposure-unequal",
  "appearance-unusual",
  "triad-count-low",
  "ball-occluded",
  "edit-lost",
  "centre-unused",
  "triad-moved-by-edit",
  "parameters-changed",
  "calibration-old",
  "rig-refined",
  "time-implausible",
  "burst-outlier",
  "breathing-unresolved",
  "radiograph-scale",
  "radiograph-spacing-unequal",
  "radiograph-point-doubtful",
  "radiograph-heights-differ",
  "radiograph-mirror-possible",
  "radiograph-rotation-unknown",
  "pixel-size-doubtful",
  "held-value-contradicted",
  "initial-tilts-doubtful",
  "initial-poses-misfit",
  "initial-far-from-triads",
] as const;

/** Flags of what was noted and taken into account. */
const REMARKS = [
  "image-banded",
  "ball-manual",
  "labels-kept",
  "rebaseline-unchecked",
  "pixel-defect",
  "burst-incomplete",
  "radiograph-landmark-left-out",
  "control-point-removed",
  "parameters-held",
  "shot-repeated",
] as const;

const RANK: Readonly<Record<Severity, number>> = { info: 0, warning: 1, error: 2 };

const SEVERITY: ReadonlyMap<string, Severity> = new Map<string, Severity>([
  ...ERRORS.map((code) => [code, "error"] as const),
  ...WARNINGS.map((code) => [code, "warning"] as const),
  ...REMARKS.map((code) => [code, "info"] as const),
]);

/** Codes whose severity is known. */
export const CODES: readonly string[] = [...SEVERITY.keys()];

/** The severity of a flag; an unknown one counts as a warning. */
export function severity(code: string): Severity {
  return SEVERITY.get(code) ?? "warning";
}

/** The flags, the most severe first. */
export function ranked(flags: readonly Flag[]): Flag[] {
  return [...flags].sort((one, other) => RANK[severity(other.code)] - RANK[severity(one.code)]);
}

/** The most severe flag; null without any. */
export function worst(flags: readonly Flag[]): Flag | null {
  return ranked(flags)[0] ?? null;
}

/** A code as people read it: `ball-occluded` is `Ball occluded`. */
export function flagName(code: string): string {
  const words = code.replaceAll("-", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}
