import { describe, expect, it } from "vitest";

import type { MeasureValue, Stage, SurgerySummary } from "../../src/api/types";
import { glanceOf } from "../../src/glance/model";
import { stageGroups } from "../../src/timeline/stages";

function measure(definition: string, curve: string, value: number): MeasureValue {
  return { definition, curve, levels: [], unit: "deg", value, sd: 1, interval: [value - 2, value + 2], status: "measured", assumed: false, reason: null };
}

/** The spine of a stage with two curves, the second of which is larger at the baseline. */
function spine(stage: string, cobbs: [number, number]): unknown {
  const measures = [measure("cobb-fixed", "curve 1", cobbs[0]), measure("cobb-fixed", "curve 2", cobbs[1]), measure("apical-rotation", "curve 2", 9)];
  return {
    stage,
    baseline: { name: "PRE", take: 1 },
    curves: [
      { name: "curve 1", upper: "T1", apex: "T3", lower: "T5" },
      { name: "curve 2", upper: "T5", apex: "T9", lower: "L1" },
    ],
    measures,
    since_baseline: stage === "PRE" ? null : { measures: [measure("cobb-fixed", "curve 2", 25)] },
    flags: [],
  };
}

function summary(...stages: { name: string; spine: unknown; reason?: string }[]): SurgerySummary {
  return {
    surgery_id: "s",
    stages: stages.map(({ name, spine: own, reason = null }) => ({ name, spine: own, spine_reason: reason })),
  } as unknown as SurgerySummary;
}

function take(name: string, minute: number, state = "succeeded", error: unknown = null): Stage {
  return {
    name,
    take: 1,
    state,
    captured_at: null,
    created_at: `2026-11-21T09:${String(minute).padStart(2, "0")}:00Z`,
    flags: [],
    job: { progress: 0, step: null, error },
  } as unknown as Stage;
}

const PRE = { name: "PRE", spine: spine("PRE", [20, -60]) };
const POST = { name: "POST", spine: spine("POST", [40, -35]) };

describe("glanceOf", () => {
  it("shows the newest stage, by the curve that was the largest at the baseline", () => {
    const shown = glanceOf(summary(PRE, POST), stageGroups([take("PRE", 1), take("POST", 2)]));
    expect(shown.stage?.name).toBe("POST");
    expect(shown.curve?.name).toBe("curve 2");
    expect(shown.cobb?.value).toBe(-35);
    expect(shown.cobbChange?.value).toBe(25);
    expect(shown.rotation?.value).toBe(9);
    expect(shown.rotationChange).toBeNull();
    expect(shown.behind).toBeNull();
  });

  it("has no change at the baseline", () => {
    const shown = glanceOf(summary(PRE), stageGroups([take("PRE", 1)]));
    expect(shown.cobb?.value).toBe(-60);
    expect(shown.cobbChange).toBeNull();
    expect(shown.baseline).toBe("PRE");
  });

  it.each([
    ["queued", null, "POST waits to be measured."],
    ["running", null, "POST is being measured."],
    ["failed", { detail: "the image is broken" }, "POST failed: the image is broken"],
    ["cancelled", null, "POST was cancelled."],
  ])("keeps the values of the stage before while the newest is %s, and says so", (state, error, behind) => {
    const groups = stageGroups([take("PRE", 1), take("POST", 2, state, error)]);
    const shown = glanceOf(summary(PRE, { name: "POST", spine: null }), groups);
    expect(shown.stage?.name).toBe("PRE");
    expect(shown.behind).toBe(behind);
  });

  it("says why a measured stage has no spine", () => {
    const groups = stageGroups([take("PRE", 1)]);
    const shown = glanceOf(summary({ name: "PRE", spine: null, reason: "no setup" }), groups);
    expect(shown.cobb).toBeNull();
    expect(shown.behind).toBe("PRE: no setup.");
  });

  it("has nothing to show of no stages", () => {
    const shown = glanceOf(summary(), []);
    expect(shown.stage).toBeNull();
    expect(shown.behind).toBe("No stage yet.");
  });
});
