import { describe, expect, it } from "vitest";

import type { Flag, Stage, SurgerySummary } from "../../src/api/types";
import { flagsOf, progressText, stageGroups } from "../../src/timeline/stages";

export function stage(values: Partial<Stage> & { progress?: number; step?: string | null }): Stage {
  const { progress = 1, step = null, ...rest } = values;
  return {
    id: "id",
    surgery_id: "s",
    name: "PRE",
    take: 1,
    calibration_id: "c",
    captured_at: null,
    created_at: "2026-11-21T09:30:00Z",
    state: "succeeded",
    flags: [],
    job: { id: "j", progress, step, error: null },
    ...rest,
  } as unknown as Stage;
}

describe("stageGroups", () => {
  it("has the stages in the order of their first takes, whatever the order of the list", () => {
    const groups = stageGroups([
      stage({ name: "POST", created_at: "2026-11-21T11:00:00Z" }),
      stage({ name: "PRE", take: 2, created_at: "2026-11-21T12:00:00Z" }),
      stage({ name: "PRE", created_at: "2026-11-21T09:00:00Z" }),
    ]);
    expect(groups.map(({ name, takes }) => [name, takes.length])).toEqual([
      ["PRE", 2],
      ["POST", 1],
    ]);
  });

  it("has the order of the summary and of the numbers of takes, whatever the clock said", () => {
    const summary = { stages: [{ name: "PRE" }, { name: "INTER" }] } as unknown as SurgerySummary;
    const groups = stageGroups(
      [
        stage({ name: "POST", created_at: "2026-11-21T07:00:00Z" }),
        stage({ name: "INTER", created_at: "2026-11-21T08:00:00Z" }),
        stage({ name: "PRE", take: 2, created_at: "2026-11-21T09:00:00Z" }),
        stage({ name: "PRE", created_at: "2026-11-21T10:00:00Z" }),
      ],
      summary,
    );
    expect(groups.map(({ name, latest }) => [name, latest.take])).toEqual([
      ["PRE", 2],
      ["INTER", 1],
      ["POST", 1],
    ]);
  });

  it("counts the latest measured take, and shows the latest one as active", () => {
    const [group] = stageGroups([
      stage({ take: 3, state: "running", created_at: "2026-11-21T12:00:00Z" }),
      stage({ take: 2, state: "failed", created_at: "2026-11-21T11:00:00Z" }),
      stage({ take: 1, captured_at: "2026-11-21T08:00:00Z" }),
    ]);
    expect(group?.counted.take).toBe(1);
    expect(group?.latest.take).toBe(3);
    expect(group?.active).toBe(true);
    expect(group?.time).toBe("2026-11-21T08:00:00Z");
  });

  it("counts the latest take while none is measured", () => {
    const [group] = stageGroups([stage({ state: "failed" })]);
    expect(group?.counted.state).toBe("failed");
    expect(group?.active).toBe(false);
  });
});

describe("flagsOf", () => {
  it("are those of the images and those of the spine", () => {
    const flag = (code: string): Flag => ({ code, detail: "" });
    const [group] = stageGroups([stage({ flags: [flag("ball-occluded")] })]);
    if (group === undefined) throw new Error("no group");
    const summary = { stages: [{ name: "PRE", spine: { flags: [flag("reference-moved")] } }] } as unknown as SurgerySummary;
    expect(flagsOf(group, summary).map(({ code }) => code)).toEqual(["ball-occluded", "reference-moved"]);
    expect(flagsOf(group, null)).toHaveLength(1);
  });
});

describe("progressText", () => {
  it("names the step", () => {
    expect(progressText(stage({ state: "running", progress: 0.456, step: "detect" }))).toBe("46% · detect");
    expect(progressText(stage({ state: "queued", progress: 0 }))).toBe("waiting for a worker");
  });
});
