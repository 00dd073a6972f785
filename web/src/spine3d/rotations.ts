/** Rotations: quaternions, turning between two, and the rotation of given tilts. */
import { cross, dot, IDENTITY, type Mat3, multiply, type Quaternion, RADIANS, unit, type Vec3 } from "./vectors";

/** The unit quaternion of a rotation matrix (Shepperd 1978: the largest component first). */
export function quaternionOf(R: Mat3): Quaternion {
  const [[a, b, c], [d, e, f], [g, h, i]] = R;
  const squares = [1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i];
  const largest = squares.indexOf(Math.max(...squares));
  const s = 2 * Math.sqrt(squares[largest] ?? 1);
  if (largest === 0) return [s / 4, (b + d) / s, (c + g) / s, (h - f) / s];
  if (largest === 1) return [(b + d) / s, s / 4, (f + h) / s, (c - g) / s];
  if (largest === 2) return [(c + g) / s, (f + h) / s, s / 4, (d - b) / s];
  return [(h - f) / s, (c - g) / s, (d - b) / s, s / 4];
}

/** The rotation matrix of a unit quaternion. */
export function matrixOfQuaternion([x, y, z, w]: Quaternion): Mat3 {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** The rotation at a fraction of the shorter turn from one to another (Shoemake 1985). */
export function slerp(from: Quaternion, to: Quaternion, fraction: number): Quaternion {
  const along = from.reduce((sum, value, k) => sum + value * (to[k] ?? 0), 0);
  const sign = along < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, Math.abs(along)));
  const isSmall = angle < 1e-6;
  const a = isSmall ? 1 - fraction : Math.sin((1 - fraction) * angle) / Math.sin(angle);
  const b = sign * (isSmall ? fraction : Math.sin(fraction * angle) / Math.sin(angle));
  const [x, y, z, w] = from.map((value, k) => a * value + b * (to[k] ?? 0)) as unknown as Quaternion;
  const size = Math.hypot(x, y, z, w);
  return [x / size, y / size, z / size, w / size];
}

/**
 * The rotation of a vertebra with given tilts and axial rotation, degrees, as `spinewatch.spine.orientation` has it: the
 * swing that takes Z to z along (tan sagittal, -tan coronal, 1), after the twist about Z.
 */
export function rotationFromTilts([coronal, sagittal, axial]: Vec3): Mat3 {
  const z = unit([Math.tan(sagittal * RADIANS), -Math.tan(coronal * RADIANS), 1]);
  const [x, y, along] = z;
  const swing: Mat3 = [
    [1 - (x * x) / (1 + along), (-x * y) / (1 + along), x],
    [(-x * y) / (1 + along), 1 - (y * y) / (1 + along), y],
    [-x, -y, along],
  ];
  const c = Math.cos(axial * RADIANS);
  const s = Math.sin(axial * RADIANS);
  return multiply(swing, [
    [c, -s, 0],
    [s, c, 0],
    [0, 0, 1],
  ]);
}

/** A rotation that takes the z axis to a direction. */
export function rotationTo(direction: Vec3): Mat3 {
  const z = unit(direction);
  const helper: Vec3 = Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const x = unit(cross(helper, z));
  const y = cross(z, x);
  if (Math.abs(dot(z, z) - 1) > 1e-9) return IDENTITY;
  return [
    [x[0], y[0], z[0]],
    [x[1], y[1], z[1]],
    [x[2], y[2], z[2]],
  ];
}
