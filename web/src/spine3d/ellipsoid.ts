/** Regions that hold the truth with 95%: ellipsoids of positions and ellipses of directions, from covariances. */
import { cross, type Mat3, multiply, RADIANS, scale, transpose, unit, type Vec3 } from "./vectors";

/** 95% quantile of chi-square with 3 and with 2 degrees of freedom. */
export const CHI_SQUARE_3 = 7.814727903251179;
export const CHI_SQUARE_2 = 5.991464547107979;

/** An ellipsoid: columns of `axes` are its principal directions (right-handed), `radii` its half axes, largest first. */
export interface Ellipsoid {
  readonly axes: Mat3;
  readonly radii: Vec3;
}

/** The 95% ellipsoid of a position from its covariance, mm²; null for a matrix that is not a covariance. */
export function positionEllipsoid(covariance: Mat3): Ellipsoid | null {
  return ellipsoid(covariance, CHI_SQUARE_3);
}

/**
 * The 95% ellipse of the tip of a vector that turns with the vertebra.
 *
 * A small rotation vector d moves the tip by d x v, so that its covariance is [v]x S [v]xᵀ, of rank 2.
 */
export function tipEllipse(vector: Vec3, rotationCovarianceDeg2: Mat3): Ellipsoid | null {
  const [x, y, z] = scale(vector, RADIANS);
  const V: Mat3 = [
    [0, -z, y],
    [z, 0, -x],
    [-y, x, 0],
  ];
  return ellipsoid(multiply(multiply(V, rotationCovarianceDeg2), transpose(V)), CHI_SQUARE_2);
}

/** The blocks of a covariance of a pose: of the position (mm²) and of the rotation vector (degrees²). */
export function covarianceBlocks(
  covariance: readonly (readonly number[])[] | null | undefined,
): { position: Mat3; rotation: Mat3 } | null {
  if (covariance?.length !== 6 || covariance.some((row) => row.length !== 6 || !row.every(Number.isFinite))) return null;
  const block = (from: number): Mat3 =>
    [0, 1, 2].map((r) => covariance[from + r]?.slice(from, from + 3)) as unknown as Mat3;
  return { position: block(0), rotation: block(3) };
}

function ellipsoid(covariance: Mat3, chiSquare: number): Ellipsoid | null {
  const { values, vectors } = symmetricEigen(covariance);
  const largest = values[0];
  if (!values.every(Number.isFinite) || largest <= 0 || values[2] < -1e-6 * largest) return null;
  const radii = values.map((value) => Math.sqrt(chiSquare * Math.max(0, value))) as unknown as Vec3;
  return { axes: vectors, radii };
}

/** Eigenvalues, largest first, and eigenvectors (columns, right-handed) of a symmetric matrix, by Jacobi's rotations. */
export function symmetricEigen(matrix: Mat3): { values: Vec3; vectors: Mat3 } {
  const A = matrix.map((row) => [...row]);
  const V = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  const at = (M: number[][], r: number, c: number): number => M[r]?.[c] ?? NaN;
  for (let sweep = 0; sweep < 30; sweep += 1) {
    const off = at(A, 0, 1) ** 2 + at(A, 0, 2) ** 2 + at(A, 1, 2) ** 2;
    const on = at(A, 0, 0) ** 2 + at(A, 1, 1) ** 2 + at(A, 2, 2) ** 2;
    if (!(off > 1e-28 * on)) break;
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]] as const) {
      if (at(A, p, q) === 0) continue;
      const angle = Math.atan2(2 * at(A, p, q), at(A, q, q) - at(A, p, p)) / 2;
      turn(A, V, p, q, Math.cos(angle), Math.sin(angle));
    }
  }
  const order = [0, 1, 2].sort((a, b) => at(A, b, b) - at(A, a, a));
  const [first = 0, second = 1] = order;
  const vector = (k: number): Vec3 => unit([at(V, 0, k), at(V, 1, k), at(V, 2, k)]);
  const [x, y] = [vector(first), vector(second)];
  const values = order.map((k) => at(A, k, k)) as unknown as Vec3;
  return { values, vectors: transpose([x, y, cross(x, y)]) };
}

function turn(A: number[][], V: number[][], p: number, q: number, c: number, s: number): void {
  for (const M of [A, V]) {
    for (const row of M) {
      const [a, b] = [row[p] ?? NaN, row[q] ?? NaN];
      row[p] = c * a - s * b;
      row[q] = s * a + c * b;
    }
  }
  const [P, Q] = [A[p] ?? [], A[q] ?? []];
  for (let k = 0; k < 3; k += 1) {
    const [a, b] = [P[k] ?? NaN, Q[k] ?? NaN];
    P[k] = c * a - s * b;
    Q[k] = s * a + c * b;
  }
}
