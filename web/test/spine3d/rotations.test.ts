import { describe, expect, it } from "vitest";

import { matrixOfQuaternion, quaternionOf, rotationFromTilts, rotationTo, slerp } from "../../src/spine3d/rotations";
import { column, cross, dot, type Mat3, type Quaternion, unit, type Vec3 } from "../../src/spine3d/vectors";

function turn(axis: Vec3, degrees: number): Quaternion {
  const [x, y, z] = unit(axis);
  const half = (degrees * Math.PI) / 360;
  return [x * Math.sin(half), y * Math.sin(half), z * Math.sin(half), Math.cos(half)];
}

function near(found: readonly number[] | Mat3, expected: readonly number[] | Mat3, digits = 9): void {
  const flat = [found, expected].map((values) => (values as readonly (number | Vec3)[]).flat());
  flat[0]?.forEach((value, k) => expect(value).toBeCloseTo(flat[1]?.[k] ?? NaN, digits));
}

describe("quaternions", () => {
  it("are those of a matrix, whatever component is largest", () => {
    const axes: Vec3[] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 3], [-2, 1, 0.5]];
    for (const axis of axes) {
      for (const degrees of [0, 30, 120, 179.9, 180, 240]) {
        const q = turn(axis, degrees);
        const found = quaternionOf(matrixOfQuaternion(q));
        const sign = Math.sign(found.reduce((sum, value, k) => sum + value * (q[k] ?? 0), 0)) || 1;
        near(found.map((value) => sign * value), q, 7);
      }
    }
  });

  it("turn a quarter about cephalad: anterior to left", () => {
    const R = matrixOfQuaternion(turn([0, 0, 1], 90));
    near(column(R, 0), [0, 1, 0]);
    near(column(R, 1), [-1, 0, 0]);
  });
});

describe("slerp", () => {
  it("is at half of the angle half of the way", () => {
    near(slerp(turn([1, 2, 3], 10), turn([1, 2, 3], 70), 0.5), turn([1, 2, 3], 40));
    near(slerp(turn([0, 0, 1], 0), turn([0, 0, 1], 90), 1 / 3), turn([0, 0, 1], 30));
  });

  it("takes the shorter way round", () => {
    const other = turn([0, 0, 1], 20).map((value) => -value) as unknown as Quaternion;
    near(matrixOfQuaternion(slerp(turn([0, 0, 1], 0), other, 0.5)), matrixOfQuaternion(turn([0, 0, 1], 10)));
  });

  it("begins and ends where it should, also without a turn", () => {
    const [a, b] = [turn([1, 0, 1], 25), turn([0, 1, 0], 110)];
    near(slerp(a, b, 0), a);
    near(slerp(a, b, 1), b);
    near(slerp(a, a, 0.3), a);
  });
});

describe("rotationFromTilts", () => {
  it("is the library's", () => {
    // spinewatch.spine.orientation.rotation_from_tilts(12.5, -20.0, 33.0)
    near(rotationFromTilts([12.5, -20, 33]), [
      [0.770326156, -0.542665107, -0.334831591],
      [0.50301038, 0.83987289, -0.203946284],
      [0.391890508, -0.011318609, 0.919942237],
    ]);
  });

  it("has the tilts as they are defined", () => {
    const [x, y, z] = column(rotationFromTilts([14, 25, -40]), 2);
    expect((Math.atan2(-y, z) * 180) / Math.PI).toBeCloseTo(14);
    expect((Math.atan2(x, z) * 180) / Math.PI).toBeCloseTo(25);
  });
});

describe("rotationTo", () => {
  it("takes z to the direction and is a rotation", () => {
    for (const direction of [[0, 0, 2], [0, 0, -1], [1, 0, 0], [-3, 2, 0.1]] as Vec3[]) {
      const R = rotationTo(direction);
      near(column(R, 2), unit(direction));
      expect(dot(column(R, 0), column(R, 1))).toBeCloseTo(0);
      near(cross(column(R, 0), column(R, 1)), column(R, 2));
    }
  });
});
