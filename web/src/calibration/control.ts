/** Drift of a rig over the stages measured with it, as a control chart. */
import type { CalibrationCheck } from "../api/types";

/** Deviations that 95% and 99.7% of a rig without drift stay within. */
export const WARNING_LIMIT = 1.96;
export const ACTION_LIMIT = 3;

/** Points on one side of the centre line, and of three beyond the warning limit, that are not chance. */
const RUN = 8;
const NEAR_LIMIT = 2;

export type QuantityKey = "rotation-x" | "rotation-y" | "rotation-z" | "shift-x" | "shift-y" | "shift-z" | "scale";

export interface ControlQuantity {
  readonly key: QuantityKey;
  readonly name: string;
  readonly unit: "deg" | "mm" | "%";
  /** What a positive value means. */
  readonly positive: string;
}

export const QUANTITIES: readonly ControlQuantity[] = [
  { key: "rotation-x", name: "Rotation about x", unit: "deg", positive: "right-handed" },
  { key: "rotation-y", name: "Rotation about y", unit: "deg", positive: "right-handed" },
  { key: "rotation-z", name: "Rotation about z", unit: "deg", positive: "right-handed" },
  { key: "shift-x", name: "Shift along x", unit: "mm", positive: "along the axis" },
  { key: "shift-y", name: "Shift along y", unit: "mm", positive: "along the axis" },
  { key: "shift-z", name: "Shift along z", unit: "mm", positive: "along the axis" },
  { key: "scale", name: "Marker scale", unit: "%", positive: "measured too large" },
];

export type Verdict = "inside" | "warning" | "out";

export interface ControlPoint {
  readonly check: CalibrationCheck;
  readonly value: number | null;
  readonly sd: number | null;
  readonly verdict: Verdict;
  /** Why it is out of control or without a value, as sentences. */
  readonly reasons: readonly string[];
}

export interface Limits {
  readonly warning: number;
  readonly action: number;
}

/** Return the limits of a point from its own standard deviation; the centre line is zero, the rig as it was calibrated. */
export function limitsOf(sd: number): Limits {
  return { warning: WARNING_LIMIT * sd, action: ACTION_LIMIT * sd };
}

/** Return the points of a chart, oldest first. */
export function controlPoints(checks: readonly CalibrationCheck[], quantity: QuantityKey): ControlPoint[] {
  const inOrder = [...checks].sort((one, other) => Date.parse(one.taken_at) - Date.parse(other.taken_at));
  const measured = inOrder.map((check) => ({ check, ...valueOf(check, quantity) }));
  const known = measured.filter((point): point is typeof point & { value: number; sd: number } => point.value !== null && point.sd !== null && point.sd > 0);
  const scores = known.map(({ value, sd }) => value / sd);
  const reasons = new Map(known.map(({ check }, i) => [check, reasonsAt(scores, i)]));
  return measured.map(({ check, value, sd }): ControlPoint => {
    const found = reasons.get(check);
    if (found === undefined || value === null || sd === null) {
      return { check, value: null, sd: null, verdict: "inside", reasons: [missing(check, quantity)] };
    }
    const beyond = Math.abs(value / sd) > WARNING_LIMIT;
    return { check, value, sd, verdict: found.length > 0 ? "out" : beyond ? "warning" : "inside", reasons: found };
  });
}

/** Return the mean of the points, weighted by their deviations, and its deviation; null without points. */
export function pooled(points: readonly ControlPoint[]): { value: number; sd: number } | null {
  let weights = 0;
  let sum = 0;
  for (const { value, sd } of points) {
    if (value === null || sd === null) continue;
    weights += sd ** -2;
    sum += value * sd ** -2;
  }
  return weights > 0 ? { value: sum / weights, sd: weights ** -0.5 } : null;
}

/** Return a chart as text, for those who do not see it. */
export function chartText(quantity: ControlQuantity, points: readonly ControlPoint[]): string {
  const out = points.filter((point) => point.verdict === "out");
  const measured = points.filter((point) => point.value !== null);
  const names = out.map(({ check, reasons }) => `${check.stage} (${reasons.join(", ")})`);
  const verdict = out.length === 0 ? "none out of control" : `${out.length} out of control: ${names.join("; ")}`;
  return `${quantity.name} of the right camera by stage, ${measured.length} stages, ${verdict}.`;
}

/** Return why the point at a place of standardized values is out of control. */
function reasonsAt(scores: readonly number[], i: number): string[] {
  const score = scores[i] ?? 0;
  const reasons: string[] = [];
  if (Math.abs(score) > ACTION_LIMIT) reasons.push("beyond the 99.7% limit");
  const near = scores.slice(Math.max(0, i - NEAR_LIMIT), i + 1);
  const beyond = near.filter((other) => Math.abs(other) > WARNING_LIMIT && Math.sign(other) === Math.sign(score));
  if (Math.abs(score) > WARNING_LIMIT && beyond.length >= NEAR_LIMIT) reasons.push("two of three beyond the 95% limit on one side");
  const run = scores.slice(Math.max(0, i - RUN + 1), i + 1);
  if (run.length === RUN && run.every((other) => other !== 0 && Math.sign(other) === Math.sign(score))) reasons.push(`${RUN} in a row on one side`);
  return reasons;
}

function valueOf({ drift }: CalibrationCheck, quantity: QuantityKey): { value: number | null; sd: number | null } {
  const nothing = { value: null, sd: null };
  if (drift === null) return nothing;
  if (quantity === "scale") {
    const scale = drift.marker_scale;
    if (scale === null || scale === undefined) return nothing;
    return { value: 100 * (scale.scale - 1), sd: 100 * Math.hypot(scale.sd, scale.common_sd) };
  }
  const axis = "xyz".indexOf(quantity.slice(-1));
  const [values, sds] = quantity.startsWith("rotation")
    ? [drift.rotation_deg, drift.rotation_sd_deg]
    : [drift.shift_mm, drift.shift_sd_mm];
  return { value: values[axis] ?? null, sd: sds[axis] ?? null };
}

function missing({ drift }: CalibrationCheck, quantity: QuantityKey): string {
  if (drift === null) return "fewer than six balls were seen in both images";
  return quantity === "scale" ? "fewer than two triads were in full view" : "no standard deviation";
}
