import { describe, expect, it } from "vitest";

import { between, bodiesOf, gapsOf, plannedBodies, reachesOf, runName } from "../../src/spine3d/bodies";
import { spineLine } from "../../src/spine3d/curve";
import { matrixOfQuaternion } from "../../src/spine3d/rotations";
import { triadsBetween, triadsOf } from "../../src/spine3d/triads";
import type { Quaternion } from "../../src/spine3d/vectors";
import { body, spine, triad, vertebra } from "./builders";

const QUARTER: Quaternion = [0, 0, Math.SQRT1_2, Math.SQRT1_2];

describe("bodiesOf", () => {
  it("has the vertebrae with a pose, at their places in the spine", () => {
    const found = bodiesOf(spine([vertebra("T11", null), vertebra("T12", [1, 2, 30], "interpolated"), vertebra("L1", [0, 0, 0])]));
    expect(found.map(({ level, order, status }) => [level, order, status])).toEqual([
      ["T12", 1, "interpolated"],
      ["L1", 2, "measured"],
    ]);
  });

  it("leaves out what is not a number", () => {
    expect(bodiesOf(spine([vertebra("T12", [NaN, 0, 0])]))).toEqual([]);
  });
});

describe("gapsOf", () => {
  const states = [
    vertebra("T9", null),
    vertebra("T10", null),
    vertebra("T11", [0, 0, 60]),
    vertebra("T12", null),
    vertebra("L1", [0, 10, 0]),
    vertebra("L2", null),
  ];

  it("joins neighbours, between their neighbours or beyond the ends", () => {
    const gaps = gapsOf(spine(states));
    expect(gaps.map(({ levels }) => runName(levels))).toEqual(["T9 to T10", "T12", "L2"]);
    expect(gaps[1]?.position).toEqual([0, 5, 30]);
    expect(gaps[0]?.position[2]).toBeGreaterThan(90);
    expect(gaps[2]?.position[2]).toBeLessThan(-30);
  });

  it("has none where nothing has a pose: there is no picture", () => {
    expect(gapsOf(spine([vertebra("T9", null)]))).toEqual([]);
  });
});

describe("between", () => {
  const from = [body("T12", 0, [0, 0, 30]), body("L1", 1, [0, 0, 0])];
  const to = [
    body("T12", 0, [10, -4, 34], { rotation: QUARTER, status: "interpolated" }),
    body("L2", 2, [0, 0, -30]),
  ];

  it("moves in a straight line and turns the shorter way", () => {
    const [half] = between(from, to, 0.5);
    expect(half?.position).toEqual([5, -2, 32]);
    const [row] = matrixOfQuaternion(half?.rotation ?? QUARTER);
    expect(row[0]).toBeCloseTo(Math.cos(Math.PI / 4), 9);
  });

  it("has the weaker status and no covariance: it is drawn, not measured", () => {
    const found = between(from, to, 0.5);
    expect(found.map(({ level, status, covariance }) => [level, status, covariance])).toEqual([["T12", "interpolated", null]]);
  });

  it("has all of a stage at its end, with covariances", () => {
    expect(between(from, to, 0)).toEqual(from);
    expect(between(from, to, 1)).toEqual(to);
  });
});

describe("plannedBodies", () => {
  const now = spine([vertebra("T12", [1, 2, 30]), vertebra("L1", [5, 0, 0])]);
  const angles_deg = [0, 0, 90];

  it("counts positions from the reference vertebra's centroid", () => {
    const [found] = plannedBodies([{ vertebra: "T12", angles_deg, position_mm: [0, 0, 28] }], now);
    expect(found?.position).toEqual([5, 0, 28]);
    expect(matrixOfQuaternion(found?.rotation ?? QUARTER)[1][0]).toBeCloseTo(1, 9);
    expect(found?.isPlaced).toBe(true);
  });

  it("turns a vertebra whose position is not planned where it is", () => {
    const [found] = plannedBodies([{ vertebra: "T12", angles_deg, position_mm: null }], now);
    expect(found?.position).toEqual([1, 2, 30]);
    expect(found?.isPlaced).toBe(false);
  });

  it("leaves out what it cannot place", () => {
    expect(plannedBodies([{ vertebra: "T11", angles_deg, position_mm: null }], now)).toEqual([]);
    expect(plannedBodies([{ vertebra: "T12", angles_deg: [1], position_mm: null }], now)).toEqual([]);
  });
});

describe("spineLine", () => {
  it("goes through the centroids, and not across a vertebra without a pose", () => {
    const bodies = [body("T10", 0, [0, 0, 90]), body("T11", 1, [4, 0, 60]), body("T12", 2, [0, 0, 30]), body("L2", 4, [0, 0, -30])];
    const line = spineLine(bodies, 4);
    expect(line.map(({ from, to }) => [from.level, to.level])).toEqual([["T10", "T11"], ["T11", "T12"]]);
    expect(line[0]?.points).toHaveLength(5);
    line[0]?.points.at(-1)?.forEach((x, k) => expect(x).toBeCloseTo([4, 0, 60][k] ?? NaN, 9));
    line[1]?.points[0]?.forEach((x, k) => expect(x).toBeCloseTo([4, 0, 60][k] ?? NaN, 9));
  });

  it("is straight through points on a line", () => {
    const bodies = [0, 1, 2, 3].map((k) => body(`T${k + 1}`, k, [k, 2 * k, -3 * k]));
    for (const { points } of spineLine(bodies)) {
      for (const [x, y, z] of points) {
        expect(y).toBeCloseTo(2 * x, 9);
        expect(z).toBeCloseTo(-3 * x, 9);
      }
    }
  });
});

describe("triadsOf", () => {
  const object_to_spine = { rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]], translation_mm: [10, 0, 5] };
  const seen = [triad("T9", [1, 2, 3], { XX: [2, 2, 3], YY: [1, 0, 3] }), triad(null, null, { XX: [0, 0, 0] })];

  it("brings them into the frame of the spine", () => {
    const found = triadsOf(spine([], { object_to_spine }), seen);
    expect(found?.[0]?.place?.position).toEqual([8, 1, 8]);
    expect(found?.[0]?.balls).toEqual([
      { name: "XX", position: [8, 2, 8], inBoth: true },
      { name: "YY", position: [10, 1, 8], inBoth: false },
    ]);
    expect(found?.[1]).toMatchObject({ label: null, place: null });
  });

  it("is null where the spine does not say how", () => {
    expect(triadsOf(spine([]), seen)).toBeNull();
  });

  it("moves labelled ones between stages", () => {
    const [from, to] = [[3, 2, 3], [5, 2, 3]].map(([x = 0, y = 0, z = 0]) =>
      triadsOf(spine([], { object_to_spine }), [triad("T9", [x, y, z], { XX: [x, y, z] }), triad(null, [x, y, z], { XX: [x, y, z] })]),
    );
    const half = triadsBetween(from ?? [], to ?? [], 0.5);
    expect(half).toHaveLength(1);
    expect(half[0]?.balls[0]?.position).toEqual([8, 4, 8]);
    expect(half[0]?.place?.position).toEqual([8, 4, 8]);
    expect(triadsBetween(from ?? [], to ?? [], 1)).toBe(to);
  });
});

describe("reachesOf", () => {
  it("is a ball around each body", () => {
    expect(reachesOf([body("T1", 0, [1, 2, 3])], 5)).toEqual([{ at: [1, 2, 3], mm: 37 }]);
  });
});
