/** Ellipses drawn over the images: of the uncertainty of a centre, and of the outline of a ball. */
import { type Camera, project } from "./camera";
import { type Symmetric2, type Vec2, type Vec3, add, cross, isFinite2, length, scale, subtract, unit } from "./vectors";

export interface Ellipse {
  /** Semi-axes, px. */
  a: number;
  b: number;
  /** Angle of the axis `a` from u towards v, degrees. */
  angleDeg: number;
}

/** 95% quantile of the chi-square distribution with two degrees of freedom. */
export const CHI2_95 = 5.991464547107979;

/** Factors by which ellipses are enlarged: few, so that a reader remembers them. */
const FACTORS = [1, 2, 5, 10, 20, 50, 100] as const;

/** The 95% ellipse of a centre with a covariance in px²; null when the covariance is none. */
export function ellipse95([xx, xy, yy]: Symmetric2): Ellipse | null {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  if (!(mean - spread >= 0)) return null;
  return {
    a: Math.sqrt(CHI2_95 * (mean + spread)),
    b: Math.sqrt(CHI2_95 * (mean - spread)),
    angleDeg: (Math.atan2(2 * xy, xx - yy) / 2) * (180 / Math.PI),
  };
}

/** The least factor that makes the median ellipse at least so large on the screen; 1 without ellipses. */
export function enlargement(ellipses: readonly Ellipse[], screenPxPerPx: number, leastPx = 5): number {
  const sizes = ellipses.map((ellipse) => ellipse.a * screenPxPerPx).sort((x, y) => x - y);
  const median = sizes[Math.floor(sizes.length / 2)];
  if (median === undefined || median <= 0) return 1;
  return FACTORS.find((factor) => median * factor >= leastPx) ?? FACTORS[FACTORS.length - 1] ?? 1;
}

/** The outline of a ball in an image: points px around it; empty when it is not wholly in view. */
export function ballOutline(camera: Camera, centre: Vec3, diameterMm: number, points = 48): Vec2[] {
  const radius = diameterMm / 2;
  const towards = subtract(camera.centre, centre);
  const distance = length(towards);
  if (distance <= radius) return [];
  // The rays that touch a sphere do so on a circle nearer to the camera than its centre.
  const axis = unit(towards);
  const middle = add(centre, scale(axis, (radius * radius) / distance));
  const circle = radius * Math.sqrt(1 - (radius / distance) ** 2);
  const across = unit(cross(axis, Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
  const up = cross(axis, across);
  const outline: Vec2[] = [];
  for (let k = 0; k < points; k++) {
    const angle = (2 * Math.PI * k) / points;
    const rim = add(scale(across, circle * Math.cos(angle)), scale(up, circle * Math.sin(angle)));
    outline.push(project(camera, add(middle, rim)));
  }
  return outline.every(isFinite2) ? outline : [];
}
