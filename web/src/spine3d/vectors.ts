/** Vectors, rotations and quaternions as plain arrays; lengths in mm, angles in degrees unless the name says otherwise. */

export type Vec3 = readonly [number, number, number];
/** Rows of a matrix; the columns of a rotation are the body's axes. */
export type Mat3 = readonly [Vec3, Vec3, Vec3];
/** x, y, z, w. */
export type Quaternion = readonly [number, number, number, number];

export const RADIANS = Math.PI / 180;
export const IDENTITY: Mat3 = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

export function add(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function subtract(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scale(a: Vec3, factor: number): Vec3 {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function length(a: Vec3): number {
  return Math.hypot(a[0], a[1], a[2]);
}

export function unit(a: Vec3): Vec3 {
  const size = length(a);
  return size > 0 ? scale(a, 1 / size) : a;
}

/** The point at a fraction of the way from one to another. */
export function mix(a: Vec3, b: Vec3, fraction: number): Vec3 {
  return add(a, scale(subtract(b, a), fraction));
}

export function apply(R: Mat3, a: Vec3): Vec3 {
  return [dot(R[0], a), dot(R[1], a), dot(R[2], a)];
}

export function transpose(R: Mat3): Mat3 {
  return [column(R, 0), column(R, 1), column(R, 2)];
}

export function column(R: Mat3, index: 0 | 1 | 2): Vec3 {
  return [R[0][index], R[1][index], R[2][index]];
}

export function multiply(A: Mat3, B: Mat3): Mat3 {
  const columns = transpose(B);
  return [row(A[0], columns), row(A[1], columns), row(A[2], columns)];
}

function row(a: Vec3, columns: Mat3): Vec3 {
  return [dot(a, columns[0]), dot(a, columns[1]), dot(a, columns[2])];
}

/** A vector of the API as one of three numbers; null for anything else. */
export function vectorOf(values: readonly (number | null)[] | null | undefined): Vec3 | null {
  const [x, y, z] = values ?? [];
  return isFinite3(x, y, z) ? [x as number, y as number, z as number] : null;
}

/** A matrix of the API as one of 3 x 3 numbers; null for anything else. */
export function matrixOf(values: readonly (readonly number[])[] | null | undefined): Mat3 | null {
  const rows = [vectorOf(values?.[0]), vectorOf(values?.[1]), vectorOf(values?.[2])];
  const [a, b, c] = rows;
  return a && b && c ? [a, b, c] : null;
}

function isFinite3(...values: unknown[]): boolean {
  return values.every((value) => typeof value === "number" && Number.isFinite(value));
}
