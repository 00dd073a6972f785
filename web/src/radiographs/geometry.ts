/** Parallel projection: what both radiographs show of a point is its height. */
import { KINDS, type Landmarks, type Point, type Slot, type VertebraDraft, type View } from "./landmarks";

export interface ViewGeometry {
  /** Distance of the rows and of the columns, mm. */
  readonly spacingMm: readonly [number, number];
  /** Side of the image on which the patient's left (PA) or front (lateral) lies. */
  readonly positiveOn: "left" | "right";
}

export type Geometry = Readonly<Record<View, ViewGeometry>>;

/** Left (PA) or anterior (lateral) and cephalad coordinates of a place, mm; the origin is the pixel (0, 0). */
export function toPlane(view: ViewGeometry, [u, v]: Point): Point {
  const [row, column] = view.spacingMm;
  return [(view.positiveOn === "left" ? -column : column) * u, -row * v];
}

/** A line across a view on which a point lies that the other view shows, and how well it is known. */
export interface Band {
  /** The line, px. */
  readonly v: number;
  /** Half of the width within which the point lies with 95%, px. */
  readonly halfWidth: number;
  /** What is on the line. */
  readonly subject: string;
}

/** Height in the PA view minus height in the lateral view, mm, and its standard deviation. */
export interface HeightOffset {
  readonly offsetMm: number;
  readonly sdMm: number;
}

const COVERAGE = 1.96;

/** The offset of the heights by least squares, of what is placed in both views; null when nothing is. */
export function heightOffset(geometry: Geometry, landmarks: Landmarks, sdPx: number): HeightOffset | null {
  const found: { difference: number; weight: number }[] = [];
  for (const vertebra of landmarks.vertebrae) {
    const heights = (["pa", "lateral"] as const).map((view) => {
      const corners = KINDS[view].filter(({ plate }) => plate !== null).map(({ name }) => vertebra[view][name]);
      return meanHeight(geometry[view], corners);
    });
    if (heights[0] != null && heights[1] != null) found.push({ difference: heights[0] - heights[1], weight: 4 });
  }
  for (const { pa, lateral } of landmarks.common) {
    if (pa === null || lateral === null) continue;
    found.push({ difference: toPlane(geometry.pa, pa)[1] - toPlane(geometry.lateral, lateral)[1], weight: 1 });
  }
  const total = found.reduce((sum, { weight }) => sum + weight, 0);
  if (total === 0) return null;
  const offsetMm = found.reduce((sum, { difference, weight }) => sum + weight * difference, 0) / total;
  return { offsetMm, sdMm: Math.sqrt(rowVariance(geometry, sdPx) / total) };
}

/**
 * The band on which a slot lies according to the other view; null when that view says nothing of it.
 *
 * A common point lies at its own height. The ends of an end plate lie at the same distance above and below the height
 * of its centre, so that the band of the second end follows from the first one.
 */
export function bandOf(geometry: Geometry, landmarks: Landmarks, slot: Slot, sdPx: number): Band | null {
  const offset = heightOffset(geometry, landmarks, sdPx);
  const other: View = slot.view === "pa" ? "lateral" : "pa";
  if (offset === null) return null;
  const here = geometry[slot.view];
  const shift = slot.view === "pa" ? offset.offsetMm : -offset.offsetMm;
  const rowHere = (sdPx * here.spacingMm[0]) ** 2;
  const rowThere = (sdPx * geometry[other].spacingMm[0]) ** 2;
  const toBand = (heightMm: number, varianceMm2: number, subject: string): Band => ({
    v: -(heightMm + shift) / here.spacingMm[0],
    halfWidth: (COVERAGE * Math.sqrt(varianceMm2 + offset.sdMm ** 2)) / here.spacingMm[0],
    subject,
  });
  if (slot.kind === "common") {
    const point = landmarks.common.find(({ name }) => name === slot.name)?.[other];
    if (point == null) return null;
    return toBand(toPlane(geometry[other], point)[1], rowHere + rowThere, `height of ${slot.name}`);
  }
  const vertebra = landmarks.vertebrae.find((each) => each.vertebra === slot.vertebra);
  const plate = KINDS[slot.view].find(({ name }) => name === slot.name)?.plate ?? null;
  if (vertebra === undefined || plate === null) return null;
  const middle = meanHeight(geometry[other], platePoints(vertebra, other, plate));
  if (middle === null) return null;
  const opposite = KINDS[slot.view].find((kind) => kind.plate === plate && kind.name !== slot.name);
  const first = opposite === undefined ? undefined : vertebra[slot.view][opposite.name];
  const name = `${plate === "superior" ? "upper" : "lower"} end plate of ${vertebra.vertebra}`;
  if (first === undefined) return toBand(middle, (rowHere + rowThere) / 2, `centre of the ${name}`);
  const mirrored = 2 * (middle + shift) - toPlane(here, first)[1] - shift;
  return toBand(mirrored, 2 * rowHere + 2 * rowThere + 3 * offset.sdMm ** 2, `other end of the ${name}`);
}

function platePoints(vertebra: VertebraDraft, view: View, plate: "superior" | "inferior"): (Point | undefined)[] {
  return KINDS[view].filter((kind) => kind.plate === plate).map(({ name }) => vertebra[view][name]);
}

function meanHeight(view: ViewGeometry, points: readonly (Point | undefined)[]): number | null {
  let sum = 0;
  for (const point of points) {
    if (point === undefined) return null;
    sum += toPlane(view, point)[1];
  }
  return points.length === 0 ? null : sum / points.length;
}

function rowVariance(geometry: Geometry, sdPx: number): number {
  return sdPx ** 2 * (geometry.pa.spacingMm[0] ** 2 + geometry.lateral.spacingMm[0] ** 2);
}
