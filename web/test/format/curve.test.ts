import { describe, expect, it } from "vitest";

import type { Curve } from "../../src/api/types";
import { apexAndSide } from "../../src/format/curve";

const CURVE: Curve = { name: "curve 1", upper: "T5", apex: "T8", lower: "T12", side: "right", open_ends: [] };

describe("apexAndSide", () => {
  it("names both", () => {
    expect(apexAndSide(CURVE)).toBe("apex T8, convex to the right");
  });

  it("says what is not known", () => {
    expect(apexAndSide({ ...CURVE, apex: null })).toBe("no vertebra between them, convex to the right");
    expect(apexAndSide({ ...CURVE, side: null })).toBe("apex T8, side of the convexity not known");
  });
});
