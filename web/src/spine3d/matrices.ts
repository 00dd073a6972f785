/** Poses as matrices of 4 x 4 numbers, column by column, as WebGL takes them. */
import type { Place } from "./bodies";
import type { Ellipsoid } from "./ellipsoid";
import { matrixOfQuaternion } from "./rotations";
import type { Mat3, Vec3 } from "./vectors";

export type Matrix4 = readonly number[];

/** The matrix that takes a shape of unit size to a pose. */
export function poseMatrix({ position, rotation }: Place, size: Vec3 = [1, 1, 1]): Matrix4 {
  return matrix4(matrixOfQuaternion(rotation), size, position);
}

/** The matrix that takes the unit sphere to an ellipsoid, or the unit circle in x and y to an ellipse. */
export function ellipsoidMatrix({ axes, radii }: Ellipsoid, centre: Vec3): Matrix4 {
  return matrix4(axes, radii, centre);
}

/** Scale along own axes, then rotation, then shift. */
export function matrix4(R: Mat3, size: Vec3, position: Vec3): Matrix4 {
  const columns = ([0, 1, 2] as const).flatMap((k) => [R[0][k] * size[k], R[1][k] * size[k], R[2][k] * size[k], 0]);
  return [...columns, ...position, 1];
}
