import { describe, expect, it } from "vitest";

import {
  CHI_SQUARE_3,
  covarianceBlocks,
  positionEllipsoid,
  symmetricEigen,
  tipEllipse,
} from "../../src/spine3d/ellipsoid";
import { ellipsoidMatrix, poseMatrix } from "../../src/spine3d/matrices";
import { matrixOfQuaternion } from "../../src/spine3d/rotations";
import { apply, column, cross, dot, type Mat3, multiply, type Quaternion, transpose } from "../../src/spine3d/vectors";
import { COVARIANCE } from "./builders";

const TURN = [1, 2, 3, 4].map((value) => value / Math.sqrt(30)) as unknown as Quaternion;
const R = matrixOfQuaternion(TURN);

function turned(values: readonly [number, number, number]): Mat3 {
  const D: Mat3 = [[values[0], 0, 0], [0, values[1], 0], [0, 0, values[2]]];
  return multiply(multiply(R, D), transpose(R));
}

describe("symmetricEigen", () => {
  it("finds the values, largest first, and the vectors of a turned ellipsoid", () => {
    const { values, vectors } = symmetricEigen(turned([1, 25, 4]));
    [25, 4, 1].forEach((value, k) => expect(values[k]).toBeCloseTo(value, 9));
    expect(Math.abs(dot(column(vectors, 0), column(R, 1)))).toBeCloseTo(1, 9);
    expect(dot(cross(column(vectors, 0), column(vectors, 1)), column(vectors, 2))).toBeCloseTo(1, 9);
  });

  it("takes a sphere and a diagonal as they are", () => {
    expect(symmetricEigen([[2, 0, 0], [0, 2, 0], [0, 0, 2]]).values).toEqual([2, 2, 2]);
    expect(symmetricEigen([[1, 0, 0], [0, 3, 0], [0, 0, 2]]).values).toEqual([3, 2, 1]);
  });
});

describe("positionEllipsoid", () => {
  it("has half axes of the deviations times the root of 7.81", () => {
    const found = positionEllipsoid(turned([0.09, 4, 1]));
    [2, 1, 0.3].forEach((sd, k) => expect(found?.radii[k]).toBeCloseTo(sd * Math.sqrt(7.8147), 3));
  });

  it("holds points whose Mahalanobis distance is the quantile", () => {
    const covariance = turned([1, 9, 4]);
    const ellipsoid = positionEllipsoid(covariance);
    const matrix = ellipsoidMatrix(ellipsoid ?? { axes: R, radii: [0, 0, 0] }, [0, 0, 0]);
    const point = [0, 1, 2].map((r) => 0.6 * (matrix[r] ?? 0) + 0.8 * (matrix[8 + r] ?? 0));
    const inverse = turned([1, 1 / 9, 1 / 4]);
    const p = point as unknown as [number, number, number];
    expect(dot(p, apply(inverse, p))).toBeCloseTo(CHI_SQUARE_3, 6);
  });

  it("refuses what is no covariance", () => {
    expect(positionEllipsoid([[0, 0, 0], [0, 0, 0], [0, 0, 0]])).toBeNull();
    expect(positionEllipsoid([[1, 0, 0], [0, -1, 0], [0, 0, 1]])).toBeNull();
    expect(positionEllipsoid([[NaN, 0, 0], [0, 1, 0], [0, 0, 1]])).toBeNull();
  });
});

describe("tipEllipse", () => {
  it("lies across the vector: rotations about x move the tip of z along y", () => {
    const found = tipEllipse([0, 0, 100], [[4, 0, 0], [0, 1, 0], [0, 0, 9]]);
    const perDegree = (100 * Math.PI) / 180;
    expect(found?.radii[0]).toBeCloseTo(2 * perDegree * Math.sqrt(5.991465), 4);
    expect(found?.radii[1]).toBeCloseTo(1 * perDegree * Math.sqrt(5.991465), 4);
    expect(found?.radii[2]).toBeCloseTo(0, 9);
    expect(Math.abs(found?.axes[1][0] ?? 0)).toBeCloseTo(1, 9);
  });
});

describe("covarianceBlocks", () => {
  it("parts the covariance of a pose", () => {
    const blocks = covarianceBlocks(COVARIANCE);
    expect(blocks?.position).toEqual([[4, 0, 0], [0, 9, 0], [0, 0, 1]]);
    expect(blocks?.rotation).toEqual([[0.25, 0, 0], [0, 1, 0], [0, 0, 0.04]]);
  });

  it("is null without one", () => {
    expect(covarianceBlocks(null)).toBeNull();
    expect(covarianceBlocks([[1, 2, 3]])).toBeNull();
    expect(covarianceBlocks([[NaN, 0, 0, 0, 0, 0], ...COVARIANCE.slice(1)])).toBeNull();
  });
});

describe("poseMatrix", () => {
  it("scales along the body's axes, turns, and shifts, column by column", () => {
    const quarter: Quaternion = [0, 0, Math.SQRT1_2, Math.SQRT1_2];
    const matrix = poseMatrix({ position: [1, 2, 3], rotation: quarter }, [10, 20, 30]);
    const expected = [0, 10, 0, 0, -20, 0, 0, 0, 0, 0, 30, 0, 1, 2, 3, 1];
    matrix.forEach((value, k) => expect(value).toBeCloseTo(expected[k] ?? NaN, 9));
  });
});
