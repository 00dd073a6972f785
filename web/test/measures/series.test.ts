import { describe, expect, it } from "vitest";

import { hasValues, pointAt, pointText, scaleRanges, seriesGroups, seriesTable, seriesText, shownStatus } from "../../src/measures/series";
import { measure, stage } from "./builders";

const DEFINITIONS = ["cobb-fixed", "cobb-reselected", "kyphosis"].map((id) => ({ id, name: `name of ${id}`, unit: "deg", formula: "f", sign: "s", reference: "r" }));
const KYPHOSIS = { definition: "kyphosis", curve: null };
const STAGES = [
  stage("PRE", {
    measures: [
      measure({ ...KYPHOSIS, levels: ["T5", "T12"], value: 20, interval: [10, 30] }),
      measure({ definition: "cobb-reselected", levels: ["T4", "T12"], value: 55, interval: [40, 70] }),
      measure(),
    ],
  }),
  stage("MID", null, "the reference is hidden"),
  stage("POST", {
    measures: [
      measure({ value: 30, interval: [25, 35], status: "bracketed", reason: "T5 has no marker" }),
      measure({ definition: "cobb-reselected", levels: ["T6", "T11"], value: 31, interval: [26, 36] }),
      measure({ ...KYPHOSIS, levels: ["T2", "T12"], value: null, sd: null, interval: null, status: "not_measured", reason: "T2 was not measured" }),
    ],
  }),
];

describe("series", () => {
  const [curve, whole] = seriesGroups(STAGES, DEFINITIONS);
  it("belong to curves and to the whole spine, in the order of the definitions", () => {
    expect(curve?.curve?.name).toBe("curve 1");
    expect(curve?.series.map((series) => series.key)).toEqual(["cobb-fixed curve 1", "cobb-reselected curve 1"]);
    expect(whole?.curve).toBeNull();
    expect(whole?.series.map((series) => series.name)).toEqual(["name of kyphosis T5\u2013T12", "name of kyphosis T2\u2013T12"]);
  });
  it("have a point for every stage, with the reason where there is no value", () => {
    const fixed = curve?.series[0];
    expect(fixed?.points.map((point) => [point.stage, point.value, point.status])).toEqual([
      ["PRE", 50, "measured"],
      ["MID", null, "not_measured"],
      ["POST", 30, "bracketed"],
    ]);
    expect(fixed?.points[1]?.reason).toBe("the reference is hidden");
    expect(whole?.series[0]?.points[2]?.reason).toBe("this stage has no such measure");
  });
  it("keep the levels of each stage where they are selected again", () => {
    expect(curve?.series[1]?.points.map((point) => point.levels)).toEqual(["T4\u2013T12", "", "T6\u2013T11"]);
  });
  it("share a scale where they are compared, that contains the intervals", () => {
    const all = [...(curve?.series ?? []), ...(whole?.series ?? [])];
    const ranges = scaleRanges(all);
    expect(ranges.get("cobb-fixed curve 1")).toEqual(ranges.get("cobb-reselected curve 1"));
    const [low, high] = ranges.get("cobb-fixed curve 1") ?? [0, 0];
    expect(low).toBeLessThan(25);
    expect(high).toBeGreaterThan(70);
    expect(ranges.get(whole?.series[0]?.key ?? "")?.[1]).toBeLessThan(40);
  });
  it("find the point of a stage, or the last one with a value", () => {
    const fixed = curve?.series[0];
    if (fixed === undefined) throw new Error("no series");
    expect(pointAt(fixed, "MID")?.stage).toBe("MID");
    expect(pointAt(fixed, null)?.stage).toBe("POST");
    expect(hasValues(fixed)).toBe(true);
    expect(whole?.series[1] && hasValues(whole.series[1])).toBe(false);
  });
  it("are told as text with unit, interval, status and reason", () => {
    const fixed = curve?.series[0];
    if (fixed === undefined) throw new Error("no series");
    expect(seriesText(fixed)).toBe(
      "name of cobb-fixed by stage. PRE: 50.0°, 95% 48.0 to 52.0°, measured; MID: none, the reference is hidden; POST: 30.0°, 95% 25.0 to 35.0°, bracketed.",
    );
    expect(pointText({ ...fixed.points[0]!, value: -3.25 }, "mm")).toContain("\u22123.3\u202fmm");
  });
  it("are copied at full precision", () => {
    const { header, rows } = seriesTable(curve?.series ?? []);
    expect(rows).toHaveLength(6);
    expect(rows[0]?.[header.indexOf("value")]).toBe(50);
    expect(rows[2]?.[header.indexOf("status")]).toBe("bracketed");
    expect(rows[0]?.[header.indexOf("unit")]).toBe("deg");
  });
});

describe("the shown status", () => {
  it("is the least certain one", () => {
    expect(shownStatus({ status: "measured", assumed: false })).toBe("measured");
    expect(shownStatus({ status: "measured", assumed: true })).toBe("assumed");
    expect(shownStatus({ status: "bracketed", assumed: true })).toBe("bracketed");
    expect(shownStatus({ status: "not_measured", assumed: true })).toBe("not_measured");
  });
});
