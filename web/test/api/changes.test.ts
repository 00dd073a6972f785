import { describe, expect, it } from "vitest";

import { announce, concerns, onChange } from "../../src/api/changes";
import type { Change } from "../../src/api/types";

function change(values: Partial<Change>): Change {
  return {
    seq: 1,
    at: "2026-11-21T09:30:00Z",
    kind: "stage",
    action: "stage:measured",
    id: "stage-1",
    surgery_id: "s",
    stage: "PRE",
    take: 1,
    ...values,
  };
}

describe("concerns", () => {
  it.each([
    ["/v1/surgeries/s", true],
    ["/v1/surgeries/s/summary", true],
    ["/v1/surgeries/s/stages?limit=200", true],
    ["/v1/surgeries/s/stages/PRE/triads", true],
    ["/v1/surgeries/other/summary", false],
    ["/v1/surgeries?limit=50", true],
    ["/v1/calibrations/c/checks", true],
    ["/v1/calibrations", false],
    ["/v1/measure-definitions", false],
  ])("a measured stage concerns %s: %s", (path, expected) => {
    expect(concerns(path, change({}))).toBe(expected);
  });

  it("lets a measured stage concern the spine of the others, a submitted one not", () => {
    const path = "/v1/surgeries/s/stages/POST/spine";
    expect(concerns(path, change({}))).toBe(true);
    expect(concerns(path, change({ action: "stage:submitted" }))).toBe(false);
  });

  it("lets a computed spine concern every stage of its surgery", () => {
    const computed = change({ kind: "spine", action: "spine:computed", stage: null, take: null, id: "s" });
    expect(concerns("/v1/surgeries/s/stages/POST/measures", computed)).toBe(true);
    expect(concerns("/v1/surgeries/t/stages/POST/measures", computed)).toBe(false);
  });

  it("lets a new calibration concern the list of calibrations", () => {
    const made = change({ kind: "calibration", action: "calibration:created", id: "c", surgery_id: null });
    expect(concerns("/v1/calibrations?limit=50", made)).toBe(true);
    expect(concerns("/v1/calibrations/c", made)).toBe(true);
    expect(concerns("/v1/calibrations/d", made)).toBe(false);
  });
});

describe("onChange", () => {
  it("is called until it ends", () => {
    const seen: number[] = [];
    const end = onChange(({ seq }) => seen.push(seq));
    announce(change({ seq: 4 }));
    end();
    announce(change({ seq: 5 }));
    expect(seen).toEqual([4]);
  });
});
