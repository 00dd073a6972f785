import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";

import { depthOf, project, rigOf } from "../../src/images/camera";
import { ballOutline, ellipse95, enlargement } from "../../src/images/ellipses";
import {
  candidatesOf,
  type Centre,
  distanceFromLine,
  distanceSigma,
  epipolarLine,
  epipolarParameters,
  intersect,
  ranges,
} from "../../src/images/epipolar";
import { type Vec2, vec2, vec3 } from "../../src/images/vectors";

// Computed by the Python library; tests/dashboard/test_images.py computes it again.
const fixture = JSON.parse(readFileSync("test/images/rig.json", "utf8"));
const rig = rigOf(fixture.rig);
const parameters = epipolarParameters({});
const limits = ranges(rig, parameters) ?? { left: [NaN, NaN] as const, right: [NaN, NaN] as const };
const [xx, xy, yy] = [0.02, 0.004, 0.015] as const;
const centres = (side: "left" | "right"): Centre[] =>
  fixture.centres[side].map((pixel: number[]) => ({ pixel: vec2(pixel), covariance: [xx, xy, yy] }));
const close = (found: readonly number[], wanted: readonly number[], digits: number): void => {
  expect(found).toHaveLength(wanted.length);
  wanted.forEach((value, k) => expect(found[k]).toBeCloseTo(value, digits));
};

describe("the camera", () => {
  it("projects points where the library does, distortion included", () => {
    fixture.points_mm.forEach((point: number[], k: number) => {
      close(project(rig.left, vec3(point)), fixture.left_px[k], 8);
      close(project(rig.right, vec3(point)), fixture.right_px[k], 8);
    });
  });

  it("has no image of a point behind it", () => {
    const behind = vec3([rig.left.centre[0], rig.left.centre[1], rig.left.centre[2] + 100]);
    expect(project(rig.left, behind)).toEqual([NaN, NaN]);
  });
});

describe("epipolar lines", () => {
  it("span the library's range of the markers", () => {
    close(limits.left, fixture.range_limits_mm[0], 7);
    close(limits.right, fixture.range_limits_mm[1], 7);
  });

  it("pass through the library's points of the ray, in both directions", () => {
    fixture.centres.left.forEach((pixel: number[], k: number) => {
      const line = epipolarLine(rig, "left", vec2(pixel), limits, 400);
      for (const point of fixture.lines_in_right_px[k]) expect(distanceFromLine(line, vec2(point))).toBeLessThan(0.002);
    });
    fixture.centres.right.forEach((pixel: number[], k: number) => {
      const line = epipolarLine(rig, "right", vec2(pixel), limits, 400);
      for (const point of fixture.lines_in_left_px[k]) expect(distanceFromLine(line, vec2(point))).toBeLessThan(0.002);
    });
  });

  it("pass through the image of the same ball with the number of points that the page draws", () => {
    fixture.left_px.forEach((pixel: number[], k: number) => {
      const line = epipolarLine(rig, "left", vec2(pixel), limits);
      expect(distanceFromLine(line, vec2(fixture.right_px[k]))).toBeLessThan(0.02);
    });
  });

  it("are bent by the lens", () => {
    const line = epipolarLine(rig, "left", vec2(fixture.left_px[4]), limits);
    const chord: Vec2[] = [line[0] as Vec2, line.at(-1) as Vec2];
    expect(Math.max(...line.map((point) => distanceFromLine(chord, point)))).toBeGreaterThan(0.2);
  });

  it("are as far from features in standard deviations as the library says", () => {
    centres("left").forEach((left, i) =>
      centres("right").forEach((right, j) => {
        expect(distanceSigma(rig, left, right, parameters.extraMrad)).toBeCloseTo(fixture.distance_sigma[i][j], 6);
      }),
    );
  });

  it("give the library's candidates from either side", () => {
    const pairs = centres("left").flatMap((centre, i) =>
      candidatesOf(rig, "left", centre, centres("right"), limits, parameters).map((j) => [i, j]),
    );
    expect(pairs).toEqual(fixture.pairs);
    const back = centres("right").flatMap((centre, j) =>
      candidatesOf(rig, "right", centre, centres("left"), limits, parameters).map((i) => [i, j]),
    );
    expect(back).toEqual(fixture.pairs);
  });

  it("have the parameters of the result", () => {
    const given = { search: { matching: { extra_sd_mrad: 0.2, epipolar: { range_mm: [500, 800], tolerance_sigma: 3 } } } };
    expect(epipolarParameters(given)).toEqual({
      rangeMm: [500, 800],
      rangeFractions: [0.65, 1.2],
      endMargin: 0.02,
      toleranceSigma: 3,
      extraMrad: 0.2,
    });
    expect(ranges(rig, epipolarParameters(given))?.left).toEqual([500, 800]);
  });

  it("have no range when the optical axes are parallel", () => {
    expect(ranges({ left: rig.left, right: { ...rig.left, centre: rig.right.centre } }, parameters)).toBeNull();
  });
});

describe("two rays", () => {
  it("meet where the library says, with its parallax", () => {
    fixture.centres.left.forEach((left: number[], k: number) => {
      const found = intersect(rig, vec2(left), vec2(fixture.centres.right[k]));
      close(found?.point ?? [], fixture.positions_mm[k], 7);
      expect(found?.parallaxMm).toBeCloseTo(fixture.parallax_mm[k], 7);
    });
  });

  it("meet nowhere when they are parallel", () => {
    const same = { left: rig.left, right: { ...rig.left, centre: rig.right.centre } };
    expect(intersect(same, [100, 100], [100, 100])).toBeNull();
  });
});

describe("ellipses", () => {
  it("contain 95% of a round distribution of 0.1 px", () => {
    const ellipse = ellipse95([0.01, 0, 0.01]);
    expect(ellipse?.a).toBeCloseTo(0.2448, 4);
    expect(ellipse?.b).toBeCloseTo(0.2448, 4);
  });

  it("have axes along the correlation", () => {
    const ellipse = ellipse95([0.02, 0.01, 0.02]);
    expect(ellipse?.angleDeg).toBeCloseTo(45, 10);
    expect((ellipse?.a ?? 0) / (ellipse?.b ?? 1)).toBeCloseTo(Math.sqrt(3), 10);
  });

  it("do not exist for what is no covariance", () => {
    expect(ellipse95([0.01, 0.02, 0.01])).toBeNull();
    expect(ellipse95([NaN, 0, 1])).toBeNull();
  });

  it("are enlarged by a round factor only as far as needed", () => {
    const ellipse = { a: 0.25, b: 0.2, angleDeg: 0 };
    expect(enlargement([ellipse, ellipse, ellipse], 2)).toBe(10);
    expect(enlargement([ellipse], 60)).toBe(1);
    expect(enlargement([], 1)).toBe(1);
  });
});

describe("the outline of a ball", () => {
  it("is as wide as the library says and around its centre", () => {
    const centre = vec3(fixture.points_mm[1]);
    const outline = ballOutline(rig.left, centre, 8);
    const width = Math.max(...outline.map((p) => p[0])) - Math.min(...outline.map((p) => p[0]));
    expect(width / fixture.ball_width_px).toBeGreaterThan(0.95);
    expect(width / fixture.ball_width_px).toBeLessThan(1.1);
    const middle = outline.reduce((sum, p) => [sum[0] + p[0] / outline.length, sum[1] + p[1] / outline.length] as Vec2, [0, 0] as Vec2);
    expect(Math.hypot(middle[0] - fixture.left_px[1][0], middle[1] - fixture.left_px[1][1])).toBeLessThan(0.1);
    expect(depthOf(rig.left, centre)).toBeGreaterThan(500);
  });

  it("does not exist when the camera is inside", () => {
    expect(ballOutline(rig.left, rig.left.centre, 8)).toEqual([]);
  });
});
