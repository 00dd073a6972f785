import { describe, expect, test } from "vitest";

import { bandOf, type Geometry, heightOffset, toPlane } from "../../src/radiographs/geometry";
import { emptyLandmarks, type Landmarks, type Point, type Slot, withPoint } from "../../src/radiographs/landmarks";

const GEOMETRY: Geometry = {
  pa: { spacingMm: [0.2, 0.18], positiveOn: "left" },
  lateral: { spacingMm: [0.25, 0.22], positiveOn: "right" },
};
/** Rows in which height 0 appears. */
const ZERO = { pa: 3500, lateral: 3200 };

function row(view: "pa" | "lateral", heightMm: number): number {
  return ZERO[view] - heightMm / GEOMETRY[view].spacingMm[0];
}

function corner(landmarks: Landmarks, view: "pa" | "lateral", vertebra: string, name: string, heightMm: number): Landmarks {
  return withPoint(landmarks, { kind: "vertebra", view, vertebra, name }, [1000, row(view, heightMm)]);
}

/** T9 with tilted end plates at 112 and 88 mm in both views. */
function digitized(landmarks: Landmarks): Landmarks {
  const heights = { superior: 112, inferior: 88 };
  let all = landmarks;
  for (const [plate, height] of Object.entries(heights)) {
    for (const [view, more, less, tilt] of [["pa", "left", "right", 3], ["lateral", "anterior", "posterior", -5]] as const) {
      all = corner(corner(all, view, "T9", `${plate}_${more}`, height + tilt), view, "T9", `${plate}_${less}`, height - tilt);
    }
  }
  return all;
}

const START = digitized(emptyLandmarks(["T9", "T10"]));
const slot = (view: "pa" | "lateral", name: string): Slot => ({ kind: "vertebra", view, vertebra: "T10", name });

test("the plane is that of the service", () => {
  expect(toPlane({ spacingMm: [0.5, 0.25], positiveOn: "left" }, [100, 40])).toEqual([-25, -20]);
});

describe("the offset of the heights", () => {
  test("is not known before something is placed in both views", () => {
    expect(heightOffset(GEOMETRY, emptyLandmarks(["T9"]), 1)).toBeNull();
    expect(bandOf(GEOMETRY, emptyLandmarks(["T9"]), { kind: "vertebra", view: "pa", vertebra: "T9", name: "superior_left" }, 1)).toBeNull();
  });

  test("is that of the bodies and the common points, with its deviation", () => {
    const point = { name: "screw", place: { kind: "triad", triad: "T9" }, pa: [1, row("pa", 50)] as Point, lateral: [2, row("lateral", 50)] as Point } as const;
    const offset = heightOffset(GEOMETRY, { ...START, common: [point] }, 2);
    expect(offset?.offsetMm).toBeCloseTo(0.2 * -3500 + 0.25 * 3200);
    expect(offset?.sdMm).toBeCloseTo(2 * Math.sqrt((0.2 ** 2 + 0.25 ** 2) / 5));
  });
});

describe("the band of the other view", () => {
  test("contains a common point at its own height", () => {
    const common = [{ name: "screw", place: { kind: "triad", triad: "T9" }, pa: [1, row("pa", 50)] as Point, lateral: null } as const];
    const band = bandOf(GEOMETRY, { ...START, common }, { kind: "common", view: "lateral", name: "screw" }, 1);
    expect(band?.v).toBeCloseTo(row("lateral", 50));
    expect(band?.halfWidth).toBeCloseTo((1.96 * Math.sqrt((0.2 ** 2 + 0.25 ** 2) * 1.25)) / 0.25);
  });

  test("is the centre of the end plate for the first end, and its mirror for the second", () => {
    let landmarks = corner(corner(START, "pa", "T10", "superior_left", 84), "pa", "T10", "superior_right", 76);
    expect(bandOf(GEOMETRY, landmarks, slot("lateral", "superior_anterior"), 1)?.v).toBeCloseTo(row("lateral", 80));
    landmarks = corner(landmarks, "lateral", "T10", "superior_anterior", 86);
    expect(bandOf(GEOMETRY, landmarks, slot("lateral", "superior_posterior"), 1)?.v).toBeCloseTo(row("lateral", 74));
    expect(bandOf(GEOMETRY, landmarks, slot("lateral", "inferior_anterior"), 1)).toBeNull();
  });

  test("works from the lateral to the PA view too, and says nothing of pedicles", () => {
    const landmarks = corner(corner(START, "lateral", "T10", "superior_anterior", 84), "lateral", "T10", "superior_posterior", 76);
    expect(bandOf(GEOMETRY, landmarks, slot("pa", "superior_left"), 1)?.v).toBeCloseTo(row("pa", 80));
    expect(bandOf(GEOMETRY, landmarks, slot("pa", "pedicle_left"), 1)).toBeNull();
  });
});
