/**
 * The collinearity camera of the rig document: object space in mm to pixels and back.
 *
 * Pixels (u right, v down) are whole numbers at pixel centres. The plate (x right, y up, mm) has its origin at the image
 * centre. A point in view has a negative third coordinate in camera space.
 */
import type { components } from "../api/schema";
import {
  type Matrix3,
  type Symmetric2,
  type Vec2,
  type Vec3,
  dot,
  multiply,
  multiplyTransposed,
  scale,
  subtract,
  vec2,
  vec3,
} from "./vectors";

export type Side = "left" | "right";
export const SIDES: readonly Side[] = ["left", "right"];
export const otherSide = (side: Side): Side => (side === "left" ? "right" : "left");

export interface Camera {
  /** Perspective centre, object space, mm. */
  centre: Vec3;
  /** Rotation from object axes to camera axes. */
  m: Matrix3;
  /** Focal length, mm. */
  f: number;
  /** Principal point on the plate, mm. */
  principal: Vec2;
  /** K1 per mm², K2 per mm⁴. */
  radial: Vec2;
  /** P1, P2 per mm. */
  decentering: Vec2;
  /** Width and height, px. */
  size: Vec2;
  /** Width and height of a pixel on the plate, mm. */
  pixel: Vec2;
}

export interface Rig {
  left: Camera;
  right: Camera;
}

/** A ray: its vector from the centre to the undistorted image plane, and the covariance there in mm². */
export interface Ray {
  centre: Vec3;
  vector: Vec3;
  covariance: Symmetric2;
}

type CameraDocument = components["schemas"]["Camera"];

const MAX_NEWTON_STEPS = 30;
const STEP_TOLERANCE_MM = 1e-14;
const RESIDUAL_TOLERANCE_MM = 1e-9;

export function cameraOf(document: CameraDocument): Camera {
  return {
    centre: vec3(document.position_mm),
    m: rotationOf(vec3(document.rotation_deg)),
    f: document.focal_length_mm,
    principal: vec2(document.principal_point_mm),
    radial: vec2(document.radial),
    decentering: vec2(document.decentering),
    size: vec2(document.image_size_px),
    pixel: vec2(document.pixel_size_mm),
  };
}

export function rigOf(document: components["schemas"]["Rig"]): Rig {
  return { left: cameraOf(document.left), right: cameraOf(document.right) };
}

/** The undistorted offset from the principal point of a pixel, mm: the left side of the collinearity equations. */
export function idealOf(camera: Camera, pixel: Vec2): Vec2 {
  return correct(camera, offsetOf(camera, pixel));
}

/** The image of an object point, px; NaN behind the camera or beyond the fold of the distortion model. */
export function project(camera: Camera, point: Vec3): Vec2 {
  const local = multiply(camera.m, subtract(point, camera.centre));
  if (!(local[2] < 0)) return [NaN, NaN];
  const factor = -camera.f / local[2];
  const offset = distort(camera, [factor * local[0], factor * local[1]]);
  const x = offset[0] + camera.principal[0];
  const y = offset[1] + camera.principal[1];
  return [x / camera.pixel[0] + (camera.size[0] - 1) / 2, -y / camera.pixel[1] + (camera.size[1] - 1) / 2];
}

/** The ray of a pixel whose centre has a covariance in px², widened by a pointing error per axis in mrad. */
export function rayOf(camera: Camera, pixel: Vec2, covariance: Symmetric2 = [0, 0, 0], extraMrad = 0): Ray {
  const offset = offsetOf(camera, pixel);
  const ideal = correct(camera, offset);
  const vector = multiplyTransposed(camera.m, [ideal[0], ideal[1], -camera.f]);
  const [a, b, d] = correctionJacobian(camera, offset);
  const [px, py] = [camera.pixel[0], -camera.pixel[1]];
  const [xx, xy, yy] = [covariance[0] * px * px, covariance[1] * px * py, covariance[2] * py * py];
  const extra = ((camera.f * extraMrad) / 1000) ** 2;
  return {
    centre: camera.centre,
    vector,
    covariance: [
      a * a * xx + 2 * a * b * xy + b * b * yy + extra,
      a * b * xx + (a * d + b * b) * xy + b * d * yy,
      b * b * xx + 2 * b * d * xy + d * d * yy + extra,
    ],
  };
}

/** The point of a ray at a depth along the optical axis, mm. */
export function pointAtDepth(camera: Camera, ray: Ray, depth: number): Vec3 {
  const along = scale(ray.vector, depth / camera.f);
  return [ray.centre[0] + along[0], ray.centre[1] + along[1], ray.centre[2] + along[2]];
}

/** The depth of a point along the optical axis, mm, positive in front of the camera. */
export function depthOf(camera: Camera, point: Vec3): number {
  return -dot(camera.m[2], subtract(point, camera.centre));
}

function rotationOf([omega, phi, kappa]: Vec3): Matrix3 {
  const [o, p, k] = [omega, phi, kappa].map((angle) => (angle * Math.PI) / 180) as [number, number, number];
  const [so, sp, sk] = [Math.sin(o), Math.sin(p), Math.sin(k)];
  const [co, cp, ck] = [Math.cos(o), Math.cos(p), Math.cos(k)];
  return [
    [cp * ck, co * sk + so * sp * ck, so * sk - co * sp * ck],
    [-cp * sk, co * ck - so * sp * sk, so * ck + co * sp * sk],
    [sp, -so * cp, co * cp],
  ];
}

function offsetOf(camera: Camera, pixel: Vec2): Vec2 {
  return [
    (pixel[0] - (camera.size[0] - 1) / 2) * camera.pixel[0] - camera.principal[0],
    -(pixel[1] - (camera.size[1] - 1) / 2) * camera.pixel[1] - camera.principal[1],
  ];
}

function correct(camera: Camera, [x, y]: Vec2): Vec2 {
  const [k1, k2] = camera.radial;
  const [p1, p2] = camera.decentering;
  const r2 = x * x + y * y;
  const factor = 1 + r2 * (k1 + r2 * k2);
  return [
    x * factor + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y,
    y * factor + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y,
  ];
}

function correctionJacobian(camera: Camera, [x, y]: Vec2): Symmetric2 {
  const [k1, k2] = camera.radial;
  const [p1, p2] = camera.decentering;
  const r2 = x * x + y * y;
  const factor = 1 + r2 * (k1 + r2 * k2);
  const slope = 2 * (k1 + 2 * r2 * k2);
  return [
    factor + slope * x * x + 6 * p1 * x + 2 * p2 * y,
    slope * x * y + 2 * p1 * y + 2 * p2 * x,
    factor + slope * y * y + 6 * p2 * y + 2 * p1 * x,
  ];
}

/** The inverse of `correct`, by Newton's method. */
function distort(camera: Camera, ideal: Vec2): Vec2 {
  let [x, y] = ideal;
  for (let step = 0; step < MAX_NEWTON_STEPS; step++) {
    const found = correct(camera, [x, y]);
    const [ex, ey] = [found[0] - ideal[0], found[1] - ideal[1]];
    const [a, b, d] = correctionJacobian(camera, [x, y]);
    const determinant = a * d - b * b;
    const dx = (d * ex - b * ey) / determinant;
    const dy = (a * ey - b * ex) / determinant;
    x -= dx;
    y -= dy;
    if (!(Math.max(Math.abs(dx), Math.abs(dy)) > STEP_TOLERANCE_MM)) break;
  }
  const found = correct(camera, [x, y]);
  const [a, b, d] = correctionJacobian(camera, [x, y]);
  const residual = Math.max(Math.abs(found[0] - ideal[0]), Math.abs(found[1] - ideal[1]));
  return a * d - b * b > 0 && residual < RESIDUAL_TOLERANCE_MM ? [x, y] : [NaN, NaN];
}
