import { expect, test } from "vitest";

import { fit, MAX_SCALE, panned, revealed, toImage, toScreen, zoomed } from "../../src/radiographs/viewport";

const IMAGE = { width: 2200, height: 4000 };
const WINDOW = { width: 600, height: 700 };

test("the whole image lies in the middle of the window", () => {
  const view = fit(IMAGE, WINDOW);
  const [left, top] = toScreen(view, [-0.5, -0.5]);
  const [right, bottom] = toScreen(view, [2199.5, 3999.5]);
  expect(left + right).toBeCloseTo(600);
  expect(top + bottom).toBeCloseTo(700);
  expect(bottom - top).toBeLessThanOrEqual(700);
});

test("image and screen are inverse, with integers at the centres of pixels", () => {
  const view = { scale: 2, x: 30, y: -40 };
  expect(toScreen(view, [0, 0])).toEqual([31, -39]);
  const [u, v] = toImage(view, toScreen(view, [12.3, 45.6]));
  expect(u).toBeCloseTo(12.3);
  expect(v).toBeCloseTo(45.6);
});

test("zooming keeps the place under the pointer, within limits", () => {
  const view = fit(IMAGE, WINDOW);
  const before = toImage(view, [200, 300]);
  const after = toImage(zoomed(view, 3, [200, 300], IMAGE, WINDOW), [200, 300]);
  expect(after[0]).toBeCloseTo(before[0]);
  expect(after[1]).toBeCloseTo(before[1]);
  expect(zoomed(view, 1e9, [0, 0], IMAGE, WINDOW).scale).toBe(MAX_SCALE);
  expect(zoomed(view, 1e-9, [0, 0], IMAGE, WINDOW).scale).toBeCloseTo(view.scale / 2);
});

test("a place outside the window is brought in, one inside moves nothing", () => {
  const view = { scale: 4, x: 0, y: 0 };
  const moved = revealed(view, [1000, 1000], WINDOW);
  const [x, y] = toScreen(moved, [1000, 1000]);
  expect(x).toBeLessThanOrEqual(540);
  expect(y).toBeLessThanOrEqual(640);
  expect(revealed(moved, [1000, 1000], WINDOW)).toBe(moved);
  expect(panned(view, 3, -4)).toEqual({ scale: 4, x: 3, y: -4 });
});
