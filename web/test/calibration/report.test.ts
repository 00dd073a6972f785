import { describe, expect, it } from "vitest";

import type { CalibrationReport, CalibrationShot, Rig } from "../../src/api/types";
import { accuracyRange, accuracyRows, axisLimits } from "../../src/calibration/accuracy";
import { ageText } from "../../src/calibration/age";
import { parameterRows, withDigits } from "../../src/calibration/cameras";
import { faults, formOf } from "../../src/calibration/new-calibration";
import { enlargement, keyLength, plotted, pointRows } from "../../src/calibration/residuals";

function shot(number: number, used: boolean): CalibrationShot {
  const residual = used ? [0.03, -0.04] : null;
  return {
    number, name: String(number), used, reconstructed: 2, mean_mm: [0, 0, 0], sd_mm: [0.02, 0.03, 0.06],
    residuals_mm: { "2": [0.1, 0.2, 0.3] },
    points: { left: [{ id: "2", u_px: 100, v_px: 50, residual_px: residual }, { id: "10", u_px: 10, v_px: 5, residual_px: null }], right: [{ id: "2", u_px: 90, v_px: 51, residual_px: residual }] },
    image_rms_left_px: used ? 0.02 : null, image_rms_right_px: used ? 0.03 : null, images: {},
  } as unknown as CalibrationShot;
}

const REPORT = {
  shots: [shot(1, true), shot(3, false)],
  leave_one_out: { name: "leave-one-out", used: false, reconstructed: 12, mean_mm: [0, 0, 0], sd_mm: [0.03, null, 0.08], residuals_mm: {} },
  removed: [{ side: "left", shot: "1", id: "10", residual_px: 9 }],
  limits: { rms_px: 0.5, baseline_sd_mm: [4, 20], reconstruction_mm: [1.5, 7.5], reference_sd_mm: [0.34, 0.35, 0.66] },
  cameras: { left: { free: ["f"], sd: { f: 0.0055 }, sd_limits: { f: 2 } }, right: { free: [], sd: {} } },
} as unknown as CalibrationReport;

describe("residuals", () => {
  it("are enlarged by a round factor, the same for all shots", () => {
    expect(enlargement(REPORT.shots, 568)).toBe(500);
    expect(enlargement([shot(3, false)], 568)).toBe(1);
    expect(keyLength(500, 568)).toBe(0.05);
  });
  it("are vectors from the points; those held out have none, removed ones are marked", () => {
    const [two, ten] = plotted(REPORT, shot(1, true), "left", 100);
    expect(two).toEqual({ id: "2", u: 100, v: 50, end: [103, 46], removed: false });
    expect(ten).toMatchObject({ end: null, removed: true });
    expect(plotted(REPORT, shot(3, false), "left", 100).map((point) => point.end)).toEqual([null, null]);
  });
  it("have one row for each point, in the order of their numbers", () => {
    expect(pointRows(REPORT, shot(1, true))).toEqual([
      { id: "2", left: [0.03, -0.04], right: [0.03, -0.04], object: [0.1, 0.2, 0.3], removed: [] },
      { id: "10", left: null, right: null, object: null, removed: ["left"] },
    ]);
  });
});

describe("accuracy", () => {
  it("is that of the shots and of points left out", () => {
    expect(accuracyRows(REPORT).map((row) => [row.name, row.kind, row.rms])).toEqual([
      ["shot 1", "used", [0.02, 0.03]],
      ["shot 3", "held-out", [null, null]],
      ["leave-one-out", "leave-one-out", [null, null]],
    ]);
  });
  it("has limits by axis, and none in an earlier report", () => {
    expect(axisLimits(REPORT, 2)).toEqual({ reference: 0.66, flagged: 1.5, refused: 7.5 });
    expect(axisLimits({ ...REPORT, limits: null }, 0)).toBeNull();
  });
  it("is shown in whole decades", () => {
    expect(accuracyRange(accuracyRows(REPORT), [axisLimits(REPORT, 0)])).toEqual([0.01, 10]);
    expect(accuracyRange([], [null])).toEqual([0.01, 1]);
  });
});

describe("cameras", () => {
  const camera = { position_mm: [1, 2, 3], rotation_deg: [4, 5, 6], focal_length_mm: 8.712345, principal_point_mm: [0, 0], radial: [1e-5, 0], decentering: [0, 0], image_size_px: [568, 416], pixel_size_mm: [0.01, 0.00845] };
  const rig = { name: "r", left: camera, right: camera } as Rig;
  it("have values, deviations, limits and what was held", () => {
    const f = parameterRows(rig, REPORT).find((row) => row.name === "f");
    expect(f?.left).toEqual({ value: 8.712345, sd: 0.0055, limit: 2, held: false });
    expect(f?.right).toEqual({ value: 8.712345, sd: null, limit: null, held: true });
    expect(parameterRows(rig, null).every((row) => !row.left.held)).toBe(true);
    expect(parameterRows(rig, null).at(-1)?.left.value).toBeCloseTo(0.845);
  });
  it("are rounded to what the deviation supports", () => {
    expect(withDigits(8.712345, 0.0055)).toEqual({ value: "8.7123", sd: "0.0055" });
    expect(withDigits(-721.58, 0.46)).toEqual({ value: "\u2212721.58", sd: "0.46" });
    expect(withDigits(2.1e-9, 3e-10)).toEqual({ value: "2.100e\u22129", sd: "3.0e\u221210" });
    expect(withDigits(0.123456789, null).value).toBe("0.123457");
  });
});

describe("the age", () => {
  const at = "2026-11-21T09:30:00Z";
  it("counts from the calibration, otherwise at least from its storage", () => {
    const later = Date.parse("2026-11-21T12:40:00Z");
    expect(ageText({ calibrated_at: at, created_at: at }, later)).toBe("3 h 10 min");
    expect(ageText({ calibrated_at: null, created_at: at }, later)).toBe("at least 3 h 10 min");
  });
});

describe("a new calibration", () => {
  const form = { name: "cart 1", controlField: "pegboard-1995", hasFieldFile: false, pairs: [{ left: 0, right: 1 }, { left: 3, right: 2 }], verify: "1", pixelSize: "" };
  it("says what is missing", () => {
    expect(faults(form)).toEqual([]);
    expect(faults({ ...form, name: " " })).toHaveLength(1);
    expect(faults({ ...form, controlField: "" })).toHaveLength(1);
    expect(faults({ ...form, controlField: "", hasFieldFile: true })).toEqual([]);
    expect(faults({ ...form, pairs: [] })).toHaveLength(2);
    expect(faults({ ...form, pairs: [{ left: 0, right: null }], verify: "0" })[0]).toContain("right image");
    expect(faults({ ...form, verify: "2" })[0]).toContain("at least one shot");
    expect(faults({ ...form, verify: "some" })[0]).toContain("not a number");
    expect(faults({ ...form, pixelSize: "0.01" })[0]).toContain("height of a pixel");
  });
  it("is sent without the names of the files", () => {
    const files = ["a", "b", "c", "d"].map((text) => ({ content: new File([text], "name of a patient.png") }));
    const sent = formOf({ ...form, pixelSize: "0.01, 0.02" }, files, null, "2026-11-21T09:30:00.000Z");
    expect(sent.getAll("left").map((file) => (file as File).name)).toEqual(["left", "left"]);
    expect(sent.getAll("right")).toHaveLength(2);
    expect([sent.get("verify"), sent.get("pixel_size"), sent.get("control_field")]).toEqual(["1", "0.01,0.02", "pegboard-1995"]);
    expect(sent.get("captured_at")).toBe("2026-11-21T09:30:00.000Z");
    expect(formOf(form, files, new Blob(["id"]), null).get("control_field")).toBeInstanceOf(File);
  });
});
