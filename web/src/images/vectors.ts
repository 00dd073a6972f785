/** Vectors of two and three numbers, and the few operations on them that cameras and views need. */

export type Vec2 = readonly [number, number];
export type Vec3 = readonly [number, number, number];
export type Matrix3 = readonly [Vec3, Vec3, Vec3];
/** A symmetric 2 x 2 matrix: its entries 11, 12 and 22. */
export type Symmetric2 = readonly [number, number, number];

export const vec2 = (values: readonly number[]): Vec2 => [values[0] ?? NaN, values[1] ?? NaN];
export const vec3 = (values: readonly number[]): Vec3 => [values[0] ?? NaN, values[1] ?? NaN, values[2] ?? NaN];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, factor: number): Vec3 => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.sqrt(dot(a, a));
export const unit = (a: Vec3): Vec3 => scale(a, 1 / length(a));
export const multiply = (m: Matrix3, a: Vec3): Vec3 => [dot(m[0], a), dot(m[1], a), dot(m[2], a)];
/** The transposed matrix times a vector. */
export const multiplyTransposed = (m: Matrix3, a: Vec3): Vec3 =>
  add(add(scale(m[0], a[0]), scale(m[1], a[1])), scale(m[2], a[2]));
export const distance2 = (a: Vec2, b: Vec2): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
export const isFinite2 = (a: Vec2): boolean => Number.isFinite(a[0]) && Number.isFinite(a[1]);
