/** Residuals of the image points of a shot: enlarged vectors, and one row for each control point. */
import type { CalibrationReport, CalibrationShot, ImagePoint } from "../api/types";

/** Steps of an enlargement within one power of ten. */
const STEPS = [1, 2, 5, 10] as const;
/** Length of the longest vector that is aimed at, as a fraction of the image's width. */
const LONGEST = 0.08;

export type Side = "left" | "right";

export interface PlottedPoint {
  readonly id: string;
  readonly u: number;
  readonly v: number;
  /** End of the enlarged residual, px; null for a point that was not adjusted. */
  readonly end: readonly [number, number] | null;
  readonly removed: boolean;
}

export interface PointRow {
  readonly id: string;
  readonly left: readonly number[] | null;
  readonly right: readonly number[] | null;
  /** Reconstructed less control point, mm. */
  readonly object: readonly number[] | null;
  readonly removed: readonly Side[];
}

/** Return a round factor by which residuals are enlarged so that the longest of all shots is seen well. */
export function enlargement(shots: readonly CalibrationShot[], widthPx: number): number {
  let longest = 0;
  for (const shot of shots) {
    for (const point of [...shot.points.left, ...shot.points.right]) longest = Math.max(longest, length(point.residual_px));
  }
  if (longest === 0) return 1;
  const factor = (LONGEST * widthPx) / longest;
  const power = 10 ** Math.floor(Math.log10(factor));
  const step = STEPS.findLast((candidate) => candidate * power <= factor * 1.001) ?? 1;
  return Math.max(1, step * power);
}

/** Return the points of one image with their enlarged residuals. */
export function plotted(report: CalibrationReport, shot: CalibrationShot, side: Side, factor: number): PlottedPoint[] {
  return shot.points[side].map((point) => ({
    id: point.id,
    u: point.u_px,
    v: point.v_px,
    end: endOf(point, factor),
    removed: isRemoved(report, shot, side, point.id),
  }));
}

/** Return one row for each control point that either image shows. */
export function pointRows(report: CalibrationReport, shot: CalibrationShot): PointRow[] {
  const left = new Map(shot.points.left.map((point) => [point.id, point]));
  const right = new Map(shot.points.right.map((point) => [point.id, point]));
  const collator = new Intl.Collator("en", { numeric: true });
  const ids = [...new Set([...left.keys(), ...right.keys()])].sort(collator.compare);
  return ids.map((id) => ({
    id,
    left: left.get(id)?.residual_px ?? null,
    right: right.get(id)?.residual_px ?? null,
    object: shot.residuals_mm[id] ?? null,
    removed: (["left", "right"] as const).filter((side) => isRemoved(report, shot, side, id)),
  }));
}

/** Return a length in pixels for the key of a plot: round, and about as long as the longest vector. */
export function keyLength(factor: number, widthPx: number): number {
  const rough = (LONGEST * widthPx) / factor;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = STEPS.findLast((candidate) => candidate * power <= rough * 1.001) ?? 1;
  return Number((step * power).toPrecision(1));
}

function endOf(point: ImagePoint, factor: number): readonly [number, number] | null {
  const [du, dv] = point.residual_px ?? [];
  return du === undefined || dv === undefined ? null : [point.u_px + factor * du, point.v_px + factor * dv];
}

function isRemoved(report: CalibrationReport, shot: CalibrationShot, side: Side, id: string): boolean {
  return report.removed.some((point) => point.side === side && point.shot === shot.name && point.id === id);
}

function length(residual: readonly number[] | null | undefined): number {
  return residual ? Math.hypot(...residual) : 0;
}
