import { describe, expect, it } from "vitest";

import { labelColumn } from "../../src/spine3d/labels";
import { fractionAt, timeAt } from "../../src/spine3d/playback";
import { movingRatio, nextStep, restRatio } from "../../src/spine3d/scene/resolution";

const OPTIONS = { spacing: 20, top: 10, bottom: 390, x: 500 };

function heights(ys: readonly number[], options = OPTIONS): number[] {
  return labelColumn(ys.map((y, k) => ({ key: String(k), x: 0, y })), options).map(({ at }) => at[1]);
}

describe("labelColumn", () => {
  it("leaves labels at the height of their vertebrae where there is room", () => {
    expect(heights([50, 100, 200])).toEqual([50, 100, 200]);
  });

  it("moves crowded ones apart about their middle", () => {
    expect(heights([100, 102, 104])).toEqual([82, 102, 122]);
  });

  it("keeps them inside, in order and apart, however they crowd", () => {
    const ys = Array.from({ length: 17 }, (_, k) => 380 + ((k * 7919) % 11));
    const found = heights(ys);
    found.slice(1).forEach((y, k) => expect(y - (found[k] ?? 0)).toBeGreaterThanOrEqual(20 - 1e-9));
    expect(found.at(-1)).toBeLessThanOrEqual(390);
    const places = labelColumn(ys.map((y, k) => ({ key: String(k), x: 0, y })), OPTIONS);
    places.slice(1).forEach(({ from }, k) => expect(from[1]).toBeGreaterThanOrEqual(places[k]?.from[1] ?? 0));
  });

  it("moves closer than the spacing only when the screen is too low", () => {
    const found = heights(Array.from({ length: 21 }, () => 50), { ...OPTIONS, bottom: 110 });
    expect(found[0]).toBeCloseTo(10);
    expect(found.at(-1)).toBeCloseTo(110);
    expect(heights([])).toEqual([]);
    expect(heights([1000])).toEqual([390]);
  });
});

describe("playback", () => {
  it("stays at a stage, moves, stays, and comes back", () => {
    expect([0, 0.9, 2, 3, 3.9, 5, 6].map((time) => fractionAt(time, false))).toEqual([0, 0, 0.5, 1, 1, 0.5, 0]);
  });

  it("only jumps when motion is unwanted", () => {
    const found = Array.from({ length: 60 }, (_, k) => fractionAt(k / 10, true));
    expect(new Set(found)).toEqual(new Set([0, 1]));
  });

  it("goes on from where the slider is", () => {
    for (const fraction of [0, 0.2, 0.5, 0.93, 1]) expect(fractionAt(timeAt(fraction), false)).toBeCloseTo(fraction, 6);
  });
});

describe("resolution", () => {
  const screen = { width: 1600, height: 900 };

  it("draws fewer pixels when frames take long, and more again when they do not", () => {
    expect(nextStep(0, 50)).toBe(1);
    expect(nextStep(2, 50)).toBe(2);
    expect(nextStep(1, 20)).toBe(1);
    expect(nextStep(1, 10)).toBe(0);
  });

  it("never draws more pixels than a graphics processor has memory for", () => {
    expect(movingRatio(screen, 1)).toBe(1);
    expect(movingRatio({ width: 4000, height: 2200 }, 3)).toBeCloseTo(Math.sqrt(8.5 / 8.8));
  });

  it("smooths edges at rest by more pixels where nothing else does", () => {
    expect(restRatio(screen, 1, true)).toBe(1);
    expect(restRatio(screen, 1, false)).toBeGreaterThan(1.3);
    expect(restRatio({ width: 300, height: 200 }, 1, false)).toBe(2);
  });
});
