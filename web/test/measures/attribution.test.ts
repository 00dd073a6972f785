import { describe, expect, it } from "vitest";

import { attributionRows, barRange, defaultManoeuvre, discrepancy, manoeuvres, reasonsOf } from "../../src/measures/attribution";
import { attribution, change, share, stage } from "./builders";

const STAGES = [
  stage("PRE", {}),
  stage("A", { since_previous: change("PRE"), since_baseline: change("PRE") }),
  stage("B", { since_previous: change("A"), since_baseline: change("PRE") }),
];

describe("manoeuvres", () => {
  it("go from each stage to the next, and from the baseline where that is another", () => {
    const all = manoeuvres(STAGES);
    expect(all.map((one) => [one.from, one.to, one.sinceBaseline])).toEqual([
      ["PRE", "A", false],
      ["A", "B", false],
      ["PRE", "B", true],
    ]);
    expect(new Set(all.map((one) => one.key)).size).toBe(3);
  });
  it("begin with that of the stage, otherwise the last", () => {
    const all = manoeuvres(STAGES);
    expect(defaultManoeuvre(all, "A")?.to).toBe("A");
    expect(defaultManoeuvre(all, null)?.from).toBe("A");
    expect(defaultManoeuvre(all, "PRE")?.to).toBe("B");
    expect(defaultManoeuvre([], null)).toBeUndefined();
  });
});

describe("rows", () => {
  const none = share(null);
  const rows = attributionRows([
    attribution(),
    attribution({ subject: "curve 2", rotation: none, distraction: none, remainder: null, reason: "nearly parallel" }),
    attribution({ subject: "T8", quantity: "lateral-displacement", unit: "mm", total: share(4, 3), rotation: share(1), distraction: share(3), remainder: 0 }),
    attribution({ subject: "T1", quantity: "lateral-displacement", unit: "mm", total: none, rotation: none, distraction: none, remainder: null, reason: "T1 was not measured: no triad" }),
    attribution({ subject: "T2", quantity: "lateral-displacement", unit: "mm", total: none, rotation: none, distraction: none, remainder: null, reason: "T2 was not measured: no triad" }),
  ]);
  it("are divided by unit, and a total without parts stays", () => {
    expect(rows.curves.map((row) => row.subject)).toEqual(["curve 1", "curve 2"]);
    expect(rows.displacements.map((row) => row.subject)).toEqual(["T8"]);
    expect(rows.missing.map((row) => row.subject)).toEqual(["T1", "T2"]);
  });
  it("add up", () => {
    expect(rows.curves.map(discrepancy)).toEqual([0, null]);
  });
  it("say how far they are determined, and that of an earlier version is not measured", () => {
    const found = attributionRows([
      attribution({ levels: ["T5", "T12"], status: "measured", assumed: false }),
      attribution({ subject: "curve 2", status: "measured", assumed: true }),
      attribution({ subject: "curve 3", status: "bracketed", assumed: true }),
      attribution({ subject: "curve 4" }),
    ]);
    expect(found.curves.map((row) => row.status)).toEqual(["measured", "assumed", "bracketed", "bracketed"]);
    expect(found.curves[0]?.levels).toBe("T5\u2013T12");
    expect(rows.missing[0]?.status).toBe("not_measured");
  });
  it("share one scale with zero in the middle, intervals within", () => {
    const [low, high] = barRange(rows.displacements);
    expect(low).toBe(-high);
    expect(high).toBeGreaterThan(10);
  });
  it("give one reason once for all whom it names", () => {
    expect(reasonsOf(rows.missing)).toEqual([{ reason: "it was not measured: no triad", subjects: ["T1", "T2"] }]);
  });
});
