import { describe, expect, it } from "vitest";

import type { CalibrationCheck } from "../../src/api/types";
import { chartText, controlPoints, limitsOf, pooled, QUANTITIES } from "../../src/calibration/control";

function check(index: number, value: number | null, sd = 1): CalibrationCheck {
  const drift = value === null ? null : {
    balls: 12, rms_px: 0.1, p_value: 0.5, drifted: false, marker_scale: null,
    rotation_deg: [value, 0, 0], rotation_sd_deg: [sd, 1, 1], shift_mm: [0, 0, value], shift_sd_mm: [1, 1, sd],
  };
  return { surgery_id: "s", stage: `S${index}`, take: 1, taken_at: new Date(Date.UTC(2026, 0, 1, 0, index)).toISOString(), age_days: 1, drift, flags: [] };
}

/** Verdicts of values, given newest first as the service lists them. */
function verdicts(values: readonly (number | null)[]): string[] {
  const checks = values.map((value, index) => check(index, value)).reverse();
  return controlPoints(checks, "rotation-x").map((point) => point.verdict);
}

describe("a control chart", () => {
  it("is in the order of time, with limits from each point's own deviation", () => {
    const points = controlPoints([check(1, 0.5, 2), check(0, 0.1)], "rotation-x");
    expect(points.map((point) => point.check.stage)).toEqual(["S0", "S1"]);
    expect(limitsOf(points[1]?.sd ?? 0)).toEqual({ warning: 3.92, action: 6 });
  });
  it("tells points between the limits from those beyond", () => {
    expect(verdicts([0, 2.5, 0, 3.5, -2.9])).toEqual(["inside", "warning", "inside", "out", "warning"]);
    expect(controlPoints([check(0, 3.5, 2)], "shift-z")[0]?.verdict).toBe("inside");
  });
  it("finds two of three beyond the 95% limit on one side only", () => {
    expect(verdicts([2.2, 0, 2.2])).toEqual(["warning", "inside", "out"]);
    expect(verdicts([2.2, 0, -2.2])).toEqual(["warning", "inside", "warning"]);
    expect(verdicts([2.2, 0, 0, 2.2])).toEqual(["warning", "inside", "inside", "warning"]);
  });
  it("finds eight in a row on one side, whatever has no value between", () => {
    expect(verdicts(Array(7).fill(0.5))).not.toContain("out");
    expect(verdicts([0.5, 0.5, 0.5, 0.5, null, 0.5, 0.5, 0.5, 0.5]).at(-1)).toBe("out");
    expect(verdicts([0.5, 0.5, 0.5, 0.5, -0.1, 0.5, 0.5, 0.5, 0.5])).not.toContain("out");
  });
  it("gives the reason instead of a value", () => {
    const [point] = controlPoints([check(0, null)], "rotation-x");
    expect(point).toMatchObject({ value: null, verdict: "inside", reasons: ["fewer than six balls were seen in both images"] });
    expect(controlPoints([check(0, 1)], "scale")[0]?.reasons).toEqual(["fewer than two triads were in full view"]);
  });
  it("shows the marker scale in percent with both of its deviations", () => {
    const one = check(0, 0);
    const scaled = { ...one, drift: { ...one.drift!, marker_scale: { distances: 12, scale: 1.01, sd: 0.003, common_sd: 0.004, p_value: 0, drifted: true, yaw_deg: 0, base_mm: 0 } } };
    const [point] = controlPoints([scaled], "scale");
    expect(point?.value).toBeCloseTo(1);
    expect(point?.sd).toBeCloseTo(0.5);
  });
  it("has a mean weighted by the deviations", () => {
    const mean = pooled(controlPoints([check(0, 1, 1), check(1, 4, 2), check(2, null)], "rotation-x"));
    expect(mean?.value).toBeCloseTo((1 + 4 / 4) / 1.25);
    expect(mean?.sd).toBeCloseTo(1 / Math.sqrt(1.25));
    expect(pooled([])).toBeNull();
  });
  it("is told as text", () => {
    const quantity = QUANTITIES[0]!;
    expect(chartText(quantity, controlPoints([check(0, 0)], "rotation-x"))).toBe("Rotation about x of the right camera by stage, 1 stages, none out of control.");
    expect(chartText(quantity, controlPoints([check(0, 9)], "rotation-x"))).toContain("S0 (beyond the 99.7% limit)");
  });
});
