/** How accurately control points are reconstructed, per axis, against limits. */
import type { CalibrationReport, ControlAccuracy } from "../api/types";
import type { Range } from "../measures/scales";

export type AccuracyKind = "used" | "held-out" | "leave-one-out";

export interface AccuracyRow {
  readonly name: string;
  readonly kind: AccuracyKind;
  readonly points: number;
  readonly sd: readonly (number | null)[];
  readonly mean: readonly (number | null)[];
  /** Image RMS, left and right, px. */
  readonly rms: readonly (number | null)[];
}

export interface AxisLimits {
  /** What the cart of 1995 reached on its board, mm. */
  readonly reference: number;
  /** RMS error above which a calibration is flagged, and refused, mm. */
  readonly flagged: number;
  readonly refused: number;
}

export const AXES = ["X", "Y", "Z"] as const;

export const KIND_TEXT: Readonly<Record<AccuracyKind, string>> = {
  used: "adjusted: residuals about 1.5 times too small",
  "held-out": "held out: not used for the calibration",
  "leave-one-out": "each point by the rig without it",
};

/** Return the shots, then the points left out one at a time. */
export function accuracyRows(report: CalibrationReport): AccuracyRow[] {
  const shots = report.shots.map((shot): AccuracyRow => {
    const kind = shot.used ? "used" : "held-out";
    return { ...rowOf(shot, kind, `shot ${shot.number}`), rms: [shot.image_rms_left_px, shot.image_rms_right_px] };
  });
  return report.leave_one_out === null ? shots : [...shots, rowOf(report.leave_one_out, "leave-one-out", "leave-one-out")];
}

/** Return the limits of an axis; null in reports of earlier versions. */
export function axisLimits(report: CalibrationReport, axis: number): AxisLimits | null {
  const { limits } = report;
  if (limits === null || limits === undefined) return null;
  const [flagged = 0, refused = 0] = limits.reconstruction_mm;
  return { reference: limits.reference_sd_mm[axis] ?? 0, flagged, refused };
}

/** Return whole decades that contain all deviations and limits, mm. */
export function accuracyRange(rows: readonly AccuracyRow[], limits: readonly (AxisLimits | null)[]): Range {
  const values = rows.flatMap((row) => row.sd).filter((sd): sd is number => sd !== null && sd > 0);
  const ends = limits.flatMap((one) => (one === null ? [] : [one.reference, one.flagged, one.refused]));
  const all = [...values, ...ends];
  if (all.length === 0) return [0.01, 1];
  const low = 10 ** Math.floor(Math.log10(Math.min(...all)));
  const high = 10 ** Math.ceil(Math.log10(Math.max(...all)));
  return [low, high > low ? high : low * 10];
}

function rowOf(accuracy: ControlAccuracy, kind: AccuracyKind, name: string): AccuracyRow {
  return { name, kind, points: accuracy.reconstructed, sd: accuracy.sd_mm, mean: accuracy.mean_mm, rms: [null, null] };
}
