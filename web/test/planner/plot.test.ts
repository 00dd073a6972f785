import { expect, test } from "vitest";

import { pathOf, placed, scaleOf, tickDigits } from "../../src/planner/plot";

test("scales have round ticks around all values, from 0 unless they are tight", () => {
  expect(scaleOf([0.12, 0.31]).ticks).toEqual([0, 0.1, 0.2, 0.3, 0.4]);
  expect(scaleOf([-60, 60], 4, true).ticks).toEqual([-100, -50, 0, 50, 100]);
  expect(scaleOf([5, 5], 4, true)).toMatchObject({ low: 5, high: 6 });
  expect(scaleOf([Number.NaN])).toEqual({ low: 0, high: 1, ticks: [0, 1] });
});

test("ticks have the digits that tell them apart", () => {
  expect(tickDigits(scaleOf([0.12, 0.31]))).toBe(1);
  expect(tickDigits(scaleOf([-60, 60], 4, true))).toBe(0);
  expect(tickDigits(scaleOf([0, 0.004]))).toBe(3);
});

test("values lie between the ends of an axis, and gaps in a line stay gaps", () => {
  const scale = scaleOf([0, 4]);
  expect(placed(scale, 1, 100, 200)).toBe(125);
  expect(pathOf([{ x: 0, y: 0 }, { x: 1, y: 1 }, { x: 2, y: Number.NaN }, { x: 3, y: 3 }])).toBe("M0.0 0.0L1.0 1.0M3.0 3.0");
});
