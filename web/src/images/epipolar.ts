/** Epipolar lines, and the features near them, as the measurement itself decides on them. */
import { type Camera, type Ray, type Rig, type Side, depthOf, idealOf, otherSide, pointAtDepth, project, rayOf } from "./camera";
import { type Symmetric2, type Vec2, type Vec3, cross, distance2, dot, isFinite2, length, multiply, scale, subtract } from "./vectors";

export interface EpipolarParameters {
  /** Range of the markers along each optical axis, mm; null to derive it from the fractions. */
  rangeMm: Vec2 | null;
  /** Near and far as fractions of the range at which the two optical axes come nearest to each other. */
  rangeFractions: Vec2;
  /** Fraction of its length by which a segment is extended at both ends. */
  endMargin: number;
  /** Largest distance of a candidate, in standard deviations. */
  toleranceSigma: number;
  /** Pointing error per axis added to every ray, mrad. */
  extraMrad: number;
}

export interface Centre {
  pixel: Vec2;
  /** px². */
  covariance: Symmetric2;
}

export interface Ranges {
  left: Vec2;
  right: Vec2;
}

/** A point nearest to two rays, and the shortest distance between the rays, mm. */
export interface Intersection {
  point: Vec3;
  parallaxMm: number;
}

const DEFAULTS: EpipolarParameters = {
  rangeMm: null,
  rangeFractions: [0.65, 1.2],
  endMargin: 0.02,
  toleranceSigma: 3.5,
  extraMrad: 0.33,
};

/** The parameters with which a result was measured, from its `parameters`; what it does not name has its default. */
export function epipolarParameters(parameters: Record<string, unknown>): EpipolarParameters {
  const matching = section(section(parameters, "search"), "matching");
  const epipolar = section(matching, "epipolar");
  return {
    rangeMm: pair(epipolar["range_mm"]),
    rangeFractions: pair(epipolar["range_fractions"]) ?? DEFAULTS.rangeFractions,
    endMargin: number(epipolar["end_margin"], DEFAULTS.endMargin),
    toleranceSigma: number(epipolar["tolerance_sigma"], DEFAULTS.toleranceSigma),
    extraMrad: number(matching["extra_sd_mrad"], DEFAULTS.extraMrad),
  };
}

/** The range of the markers along both optical axes, mm; null when the axes do not meet in front of the cameras. */
export function ranges(rig: Rig, parameters: EpipolarParameters): Ranges | null {
  if (parameters.rangeMm !== null) return { left: parameters.rangeMm, right: parameters.rangeMm };
  const axes: [Vec3, Vec3] = [scale(rig.left.m[2], -1), scale(rig.right.m[2], -1)];
  const base = subtract(rig.right.centre, rig.left.centre);
  const cosine = dot(axes[0], axes[1]);
  const determinant = 1 - cosine * cosine;
  if (determinant < 1e-12) return null;
  const left = (dot(base, axes[0]) - cosine * dot(base, axes[1])) / determinant;
  const right = (cosine * dot(base, axes[0]) - dot(base, axes[1])) / determinant;
  if (!(left > 0 && right > 0)) return null;
  const [near, far] = parameters.rangeFractions;
  return { left: [near * left, far * left], right: [near * right, far * right] };
}

/** The epipolar line of a pixel of one image in the other one: points px from near to far, without those not in view. */
export function epipolarLine(rig: Rig, side: Side, pixel: Vec2, limits: Ranges, points = 64): Vec2[] {
  const camera = rig[side];
  const ray = rayOf(camera, pixel);
  const [near, far] = limits[side];
  const line: Vec2[] = [];
  for (let k = 0; k < points; k++) {
    // Equal steps of 1/depth are about equal steps along the line.
    const inverse = 1 / near + ((1 / far - 1 / near) * k) / (points - 1);
    const image = project(rig[otherSide(side)], pointAtDepth(camera, ray, 1 / inverse));
    if (isFinite2(image)) line.push(image);
  }
  return line;
}

/** The distance of a point from a line of points, px; infinite from a line of fewer than two. */
export function distanceFromLine(line: readonly Vec2[], point: Vec2): number {
  let nearest = Infinity;
  for (let k = 1; k < line.length; k++) {
    nearest = Math.min(nearest, distanceFromSegment(line[k - 1] as Vec2, line[k] as Vec2, point));
  }
  return nearest;
}

/** The signed distance of a left and a right centre from each other's epipolar line, in standard deviations. */
export function distanceSigma(rig: Rig, left: Centre, right: Centre, extraMrad: number): number {
  const l = rayOf(rig.left, left.pixel, left.covariance, extraMrad);
  const r = rayOf(rig.right, right.pixel, right.covariance, extraMrad);
  const base = subtract(rig.right.centre, rig.left.centre);
  const fromLeft = cross(base, l.vector);
  const fromRight = cross(r.vector, base);
  const variance = along(rig.right, fromLeft, r.covariance) + along(rig.left, fromRight, l.covariance);
  return dot(fromLeft, r.vector) / Math.sqrt(variance);
}

/** The numbers of the centres in the other image that may be images of the same ball. */
export function candidatesOf(
  rig: Rig,
  side: Side,
  centre: Centre,
  others: readonly Centre[],
  limits: Ranges,
  parameters: EpipolarParameters,
): number[] {
  const other = otherSide(side);
  return others.flatMap((candidate, index) => {
    const [left, right] = side === "left" ? [centre, candidate] : [candidate, centre];
    const isNear = Math.abs(distanceSigma(rig, left, right, parameters.extraMrad)) <= parameters.toleranceSigma;
    const isBetween =
      isWithin(rig, side, centre.pixel, candidate.pixel, limits, parameters.endMargin) &&
      isWithin(rig, other, candidate.pixel, centre.pixel, limits, parameters.endMargin);
    return isNear && isBetween ? [index] : [];
  });
}

/** The point nearest to the rays of a left and a right pixel; null for parallel rays. */
export function intersect(rig: Rig, left: Vec2, right: Vec2): Intersection | null {
  const [l, r] = [rayOf(rig.left, left), rayOf(rig.right, right)];
  const [a, b] = [scale(l.vector, 1 / length(l.vector)), scale(r.vector, 1 / length(r.vector))];
  const base = subtract(r.centre, l.centre);
  const cosine = dot(a, b);
  const determinant = 1 - cosine * cosine;
  if (determinant < 1e-12) return null;
  const s = (dot(base, a) - cosine * dot(base, b)) / determinant;
  const t = (cosine * dot(base, a) - dot(base, b)) / determinant;
  const [p, q] = [pointOn(l, a, s), pointOn(r, b, t)];
  if (depthOf(rig.left, p) <= 0 || depthOf(rig.right, q) <= 0) return null;
  return {
    point: [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2],
    parallaxMm: length(subtract(p, q)),
  };
}

function pointOn(ray: Ray, direction: Vec3, distance: number): Vec3 {
  const along = scale(direction, distance);
  return [ray.centre[0] + along[0], ray.centre[1] + along[1], ray.centre[2] + along[2]];
}

/** The variance of a plane's normal times a vector on the undistorted image plane of a camera. */
function along(camera: Camera, normal: Vec3, covariance: Symmetric2): number {
  const [gx, gy] = [dot(normal, camera.m[0]), dot(normal, camera.m[1])];
  return gx * gx * covariance[0] + 2 * gx * gy * covariance[1] + gy * gy * covariance[2];
}

function isWithin(rig: Rig, side: Side, from: Vec2, candidate: Vec2, limits: Ranges, margin: number): boolean {
  const [camera, other] = [rig[side], rig[otherSide(side)]];
  const ray = rayOf(camera, from);
  const [near, far] = limits[side].map((depth) => idealOfPoint(other, pointAtDepth(camera, ray, depth))) as [Vec2, Vec2];
  const ideal = idealOf(other, candidate);
  const [dx, dy] = [far[0] - near[0], far[1] - near[1]];
  const s = ((ideal[0] - near[0]) * dx + (ideal[1] - near[1]) * dy) / (dx * dx + dy * dy);
  return s >= -margin && s <= 1 + margin;
}

function idealOfPoint(camera: Camera, point: Vec3): Vec2 {
  const local = multiply(camera.m, subtract(point, camera.centre));
  if (!(local[2] < 0)) return [NaN, NaN];
  return [(-camera.f * local[0]) / local[2], (-camera.f * local[1]) / local[2]];
}

function distanceFromSegment(a: Vec2, b: Vec2, point: Vec2): number {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const squared = dx * dx + dy * dy;
  if (squared === 0) return distance2(a, point);
  const s = Math.min(1, Math.max(0, ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / squared));
  return distance2([a[0] + s * dx, a[1] + s * dy], point);
}

function section(parent: Record<string, unknown>, name: string): Record<string, unknown> {
  const value = parent[name];
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function number(value: unknown, otherwise: number): number {
  return typeof value === "number" ? value : otherwise;
}

function pair(value: unknown): Vec2 | null {
  return Array.isArray(value) && value.length === 2 && value.every((item) => typeof item === "number")
    ? [value[0] as number, value[1] as number]
    : null;
}
