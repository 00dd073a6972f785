import { describe, expect, test } from "vitest";

import type { InitialRadiographs } from "../../src/api/types";
import { faultsOf, fromDocument, isComplete, toDocument } from "../../src/radiographs/document";
import type { Geometry } from "../../src/radiographs/geometry";
import { emptyLandmarks, type Landmarks, type Slot, withPoint } from "../../src/radiographs/landmarks";

const GEOMETRY: Geometry = {
  pa: { spacingMm: [0.2, 0.2], positiveOn: "left" },
  lateral: { spacingMm: [0.2, 0.2], positiveOn: "right" },
};
const PAIR = { pa: "p", lateral: "l" };

function vertebra(name: string, v: number): InitialRadiographs["vertebrae"][number] {
  return {
    vertebra: name,
    pa: {
      superior_left: [900, v],
      superior_right: [1100, v],
      inferior_left: [900, v + 120],
      inferior_right: [1100, v + 120],
      pedicle_left: [950, v + 50],
      pedicle_right: [1050, v + 50],
    },
    lateral: {
      superior_anterior: [1100, v],
      superior_posterior: [900, v],
      inferior_anterior: [1100, v + 120],
      inferior_posterior: [900, v + 120],
    },
  };
}

const INITIAL: InitialRadiographs = {
  kind: "radiographs",
  ...PAIR,
  vertebrae: [vertebra("T9", 1000), vertebra("T10", 1200)],
  common: [
    { name: "a", pa: [1, 2], lateral: [3, 4], object_mm: [1, 2, 3], object_sd_mm: 0.5, triad: null },
    { name: "b", pa: [5, 6], lateral: [7, 8], object_mm: null, object_sd_mm: 0, triad: "T9" },
    { name: "c", pa: [9, 1], lateral: [2, 3], object_mm: null, object_sd_mm: 0, triad: "T10" },
  ],
  landmark_sd_px: 2,
};
const LANDMARKS = fromDocument(INITIAL);

function moved(view: "pa" | "lateral", level: string, name: string, point: readonly [number, number] | null): Landmarks {
  const slot: Slot = { kind: "vertebra", view, vertebra: level, name };
  return withPoint(LANDMARKS, slot, point);
}

test("a stored document is the same after it was edited without a change", () => {
  expect(toDocument(LANDMARKS, PAIR, GEOMETRY, 2)).toEqual({ initial: INITIAL, faults: [] });
  expect(isComplete(LANDMARKS)).toBe(true);
});

test("a single pedicle is left out", () => {
  const { initial } = toDocument(moved("pa", "T9", "pedicle_left", null), PAIR, GEOMETRY, 2);
  expect(initial?.vertebrae[0]?.pa.pedicle_right).toBeUndefined();
});

describe("faults", () => {
  const texts = (landmarks: Landmarks): string[] => faultsOf(landmarks, GEOMETRY).map(({ text }) => text);

  test("name what is missing and lead to it", () => {
    const landmarks = moved("lateral", "T10", "inferior_anterior", null);
    const [fault] = faultsOf(landmarks, GEOMETRY);
    expect(fault?.text).toBe("T10: 1 of 4 corners missing in the lateral view");
    expect(fault?.slot).toEqual({ kind: "vertebra", view: "lateral", vertebra: "T10", name: "inferior_anterior" });
    expect(isComplete(landmarks)).toBe(false);
    expect(toDocument(landmarks, PAIR, GEOMETRY, 2).initial).toBeNull();
  });

  test("find exchanged sides, end plates and pedicles", () => {
    expect(texts(moved("pa", "T9", "superior_left", [1150, 1000]))).toEqual([
      "T9: superior left and superior right look exchanged in the PA view",
    ]);
    expect(texts(moved("lateral", "T9", "superior_anterior", [1100, 1130]))).toEqual([
      "T9: superior anterior and inferior anterior look exchanged in the lateral view",
    ]);
    expect(texts(moved("pa", "T9", "pedicle_left", [1070, 1050]))).toHaveLength(1);
  });

  test("find vertebrae in another order than their names", () => {
    const exchanged = fromDocument({ ...INITIAL, vertebrae: [vertebra("T9", 1200), vertebra("T10", 1000)] });
    expect(texts(exchanged)).toEqual(["T10 lies above T9 in the PA view", "T10 lies above T9 in the lateral view"]);
  });

  test("ask for vertebrae and common points", () => {
    expect(texts(emptyLandmarks([]))).toEqual([
      "digitize at least two vertebrae",
      "add common points until there are three, not on one line",
    ]);
  });
});
