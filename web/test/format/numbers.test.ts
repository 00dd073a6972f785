import { describe, expect, it } from "vitest";

import { DASH, digitsFor, fixed, interval, MINUS, signed, withUnit } from "../../src/format/numbers";

describe("fixed", () => {
  it("has fixed digits and a true minus sign", () => {
    expect(fixed(58.34)).toBe("58.3");
    expect(fixed(-3.7349, 2)).toBe(`${MINUS}3.73`);
  });

  it("never shows a negative zero", () => {
    expect(fixed(-0.04)).toBe("0.0");
    expect(fixed(-0)).toBe("0.0");
  });

  it.each([null, undefined, Number.NaN, Number.POSITIVE_INFINITY])("shows %s as a dash, never as 0", (value) => {
    expect(fixed(value)).toBe(DASH);
  });
});

describe("signed", () => {
  it("shows the sign of a change", () => {
    expect(signed(1.25)).toBe("+1.3");
    expect(signed(-1.25)).toBe(`${MINUS}1.3`);
    expect(signed(0.01)).toBe("0.0");
    expect(signed(null)).toBe(DASH);
  });
});

describe("withUnit", () => {
  it("puts a degree sign behind the number, and a space before other units", () => {
    expect(withUnit("5", "deg")).toBe("5°");
    expect(withUnit("5", "mm")).toBe("5\u202fmm");
    expect(withUnit("5", "")).toBe("5");
  });
});

describe("interval", () => {
  it("names both ends and the unit once", () => {
    expect(interval(-45.03, 37.56, "deg")).toBe(`${MINUS}45.0 to 37.6°`);
  });

  it("is a dash when an end is missing", () => {
    expect(interval(null, 3, "mm")).toBe(DASH);
  });
});

describe("digitsFor", () => {
  it.each([
    [20, 0],
    [1.2, 0],
    [0.6, 1],
    [0.04, 2],
    [0.0001, 3],
    [null, 1],
    [0, 1],
  ])("of %s is %s", (sd, digits) => {
    expect(digitsFor(sd)).toBe(digits);
  });
});
