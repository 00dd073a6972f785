import { describe, expect, it } from "vitest";

import { referenceFor, vertebraeOf } from "../../src/surgeries/new-surgery";

describe("vertebraeOf", () => {
  it.each([
    ["L1 T11 T9 T7", ["L1", "T11", "T9", "T7"]],
    ["l1, t11;  T9 / t7 ", ["L1", "T11", "T9", "T7"]],
    ["", []],
  ])("of %s", (text, names) => {
    expect(vertebraeOf(text)).toEqual(names);
  });
});

describe("referenceFor", () => {
  it("is the more caudal end, in either order", () => {
    expect(referenceFor(["L1", "T11", "T7"], "")).toBe("L1");
    expect(referenceFor(["T7", "T11", "L1"], "")).toBe("L1");
    expect(referenceFor(["T7", "T11"], "")).toBe("T11");
  });

  it("is the chosen one while that has a marker", () => {
    expect(referenceFor(["T7", "T11", "L1"], "T11")).toBe("T11");
    expect(referenceFor(["T7", "L1"], "T11")).toBe("L1");
  });
});
