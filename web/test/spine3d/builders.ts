import type { Origin, StageSpine, Triad, VertebraState } from "../../src/api/types";
import { matrixOfQuaternion } from "../../src/spine3d/rotations";
import type { Body } from "../../src/spine3d/bodies";
import type { Quaternion, Vec3 } from "../../src/spine3d/vectors";
import type { Palette } from "../../src/spine3d/appearance";
import { PALETTE_NAMES } from "../../src/spine3d/appearance";

export const PALETTE: Palette = Object.fromEntries(
  PALETTE_NAMES.map((name, k) => [name, [k / PALETTE_NAMES.length, 0.5, 1 - k / PALETTE_NAMES.length] as const]),
);
export const COVARIANCE = [4, 9, 1, 0.25, 1, 0.04].map((value, row) => [0, 1, 2, 3, 4, 5].map((k) => (k === row ? value : 0)));

export function vertebra(
  name: string,
  position: Vec3 | null,
  origin: Origin = "measured",
  rotation: Quaternion = [0, 0, 0, 1],
): VertebraState {
  const isPosed = position !== null;
  return {
    vertebra: name,
    origin: isPosed ? origin : "not_measured",
    marked: origin === "measured",
    reason: isPosed ? null : "it carries no triad",
    position_mm: position && [...position],
    position_sd_mm: isPosed ? [2, 3, 1] : null,
    normal: null,
    angles_deg: null,
    rotation: isPosed ? matrixOfQuaternion(rotation).map((row) => [...row]) : null,
    rotation_sd_deg: null,
    covariance: isPosed ? COVARIANCE : null,
    coronal_tilt_deg: 1,
    coronal_tilt_sd_deg: 0.5,
    sagittal_tilt_deg: null,
    sagittal_tilt_sd_deg: null,
    axial_rotation_deg: null,
    axial_rotation_sd_deg: null,
  };
}

export function spine(vertebrae: VertebraState[], changes: Partial<StageSpine> = {}): StageSpine {
  return {
    surgery_id: "s",
    stage: "POST",
    take: 1,
    setup_revision: 1,
    frame: "patient axes at stage PRE",
    object_to_spine: null,
    reference_vertebra: "L1",
    reference_line: "a line",
    initial: "poses",
    baseline: { name: "PRE", take: 1, calibration_id: "c" },
    vertebrae,
    curves: [],
    measures: [],
    since_baseline: null,
    since_previous: null,
    remaining: null,
    target_measures: null,
    flags: [],
    parameters: {},
    version: "1",
    ...changes,
  };
}

export function triad(label: string | null, position: Vec3 | null, balls: Record<string, Vec3>): Triad {
  return {
    label,
    label_reason: null,
    model: "flat",
    reason: null,
    position_mm: position && [...position],
    position_sd_mm: null,
    normal: null,
    angles_deg: null,
    rotation: position && [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    rotation_sd_deg: null,
    covariance: null,
    error_mm: 0.1,
    balls: Object.fromEntries(
      Object.entries(balls).map(([name, at]) => [
        name,
        { position_mm: [...at], sd_mm: [1, 1, 1], left: [1, 2], right: name === "YY" ? null : [1, 2], parallax_mm: null },
      ]),
    ),
  };
}

export function body(level: string, order: number, position: Vec3, changes: Partial<Body> = {}): Body {
  return { level, order, status: "measured", position, rotation: [0, 0, 0, 1], size: [30, 40, 24], covariance: COVARIANCE, ...changes };
}
