import { describe, expect, it } from "vitest";

import { decades, linear, logarithmic, rangeOf, shownLabels, symmetric, tickDigits, ticks, withZero } from "../../src/measures/scales";

describe("ranges", () => {
  it("contain the known numbers with a margin", () => {
    expect(rangeOf([0, null, 10, Number.NaN, undefined], 0.1)).toEqual([-1, 11]);
  });
  it("have an extent for one number, and without any", () => {
    expect(rangeOf([5], 0, 2)).toEqual([4, 6]);
    expect(rangeOf([null], 0, 3)).toEqual([-3, 3]);
  });
  it("contain zero or have it in the middle", () => {
    expect(withZero([2, 5])).toEqual([0, 5]);
    expect(symmetric([2, -7], 0, 1)).toEqual([-7, 7]);
  });
});

describe("ticks", () => {
  it("are round and within the range", () => {
    expect(ticks([-0.9, 1.1], 4)).toEqual([-0.5, 0, 0.5, 1]);
    expect(ticks([0, 100], 4)).toEqual([0, 25, 50, 75, 100]);
    expect(ticks([0.0012, 0.0034], 4)).toEqual([0.002, 0.003]);
    expect(ticks([1, 1], 4)).toEqual([]);
  });
  it("tell the digits that they need", () => {
    expect(tickDigits([0, 2.5, 5])).toBe(1);
    expect(tickDigits([0, 10])).toBe(0);
    expect(tickDigits([0, 0.25])).toBe(2);
  });
  it("are powers of ten on a logarithmic scale", () => {
    expect(decades([0.01, 10])).toEqual([0.01, 0.1, 1, 10]);
  });
});

describe("maps", () => {
  it("are linear or logarithmic", () => {
    expect(linear([0, 10], [100, 0])(2.5)).toBe(75);
    const map = logarithmic([0.01, 1], [0, 200]);
    expect(map(0.1)).toBeCloseTo(100);
    expect(map(0)).toBe(0);
    expect(map(99)).toBeCloseTo(200);
  });
});

describe("labels", () => {
  it("are all shown where there is room", () => {
    expect([...shownLabels(3, 5)].sort()).toEqual([0, 1, 2]);
  });
  it("keep the ends and what matters, and never come too close", () => {
    const shown = [...shownLabels(60, 6, 33)].sort((one, other) => one - other);
    expect(shown).toContain(0);
    expect(shown).toContain(33);
    expect(shown).toContain(59);
    for (let i = 1; i < shown.length; i += 1) expect((shown[i] ?? 0) - (shown[i - 1] ?? 0)).toBeGreaterThanOrEqual(10);
  });
});
