/** What is drawn of a spine: bodies with poses, gaps where nothing is measured, and what lies between two stages. */
import type { Origin, StageSpine, TargetVertebra, VertebraState } from "../api/types";
import { quaternionOf, rotationFromTilts, slerp } from "./rotations";
import { bodySize } from "./size";
import { add, matrixOf, mix, type Quaternion, scale, subtract, unit, type Vec3, vectorOf } from "./vectors";
import type { Reach } from "./views";

/** A vertebra with a pose, in the frame of the spine. */
export interface Body {
  readonly level: string;
  /** Place in the spine, cranial first. */
  readonly order: number;
  readonly status: Origin;
  readonly position: Vec3;
  readonly rotation: Quaternion;
  /** Depth, width and height, mm. */
  readonly size: Vec3;
  readonly covariance: readonly (readonly number[])[] | null;
}

/** Neighbouring vertebrae without a pose. */
export interface Gap {
  readonly levels: readonly string[];
  /** Where it is shown: between its neighbours, or beyond the end of the measured span. */
  readonly position: Vec3;
}

export interface Place {
  readonly position: Vec3;
  readonly rotation: Quaternion;
}

const BEYOND_MM = 42;

/** The vertebrae of a stage that have a pose, cranial first. */
export function bodiesOf(spine: StageSpine): Body[] {
  return spine.vertebrae.flatMap((state, order) => {
    const place = placeOf(state);
    if (place === null) return [];
    const { vertebra: level, origin: status, covariance } = state;
    return [{ level, order, status, ...place, size: bodySize(level), covariance }];
  });
}

/** The runs of vertebrae without a pose, and where a mark says so. */
export function gapsOf(spine: StageSpine): Gap[] {
  const bodies = bodiesOf(spine);
  const drawn = new Set(bodies.map((body) => body.order));
  if (bodies.length === 0) return [];
  const runs: number[][] = [];
  spine.vertebrae.forEach((_, order) => {
    if (drawn.has(order)) return;
    const last = runs.at(-1);
    if (last?.at(-1) === order - 1) last.push(order);
    else runs.push([order]);
  });
  return runs.map((orders) => ({
    levels: orders.map((order) => spine.vertebrae[order]?.vertebra ?? ""),
    position: gapPosition(bodies, orders[0] ?? 0),
  }));
}

/** Name of a run of vertebrae: `T1 to T6`. */
export function runName(levels: readonly string[]): string {
  const [first = "", last = first] = [levels[0], levels.at(-1)];
  return first === last ? first : `${first} to ${last}`;
}

/**
 * The bodies at a fraction of the way from one stage to another: straight in position, the shorter turn in rotation.
 * A body that only one of the stages has is drawn at that stage alone. What lies between stages is drawn, not measured:
 * the status is the weaker of the two, and there is no covariance.
 */
export function between(from: readonly Body[], to: readonly Body[], fraction: number): Body[] {
  if (fraction <= 0) return [...from];
  if (fraction >= 1) return [...to];
  const earlier = new Map(from.map((body) => [body.level, body]));
  return to.flatMap((body) => {
    const start = earlier.get(body.level);
    if (start === undefined) return [];
    const place = placeBetween(start, body, fraction);
    return [{ ...body, ...place, status: weaker(start.status, body.status), covariance: null }];
  });
}

export function placeBetween(from: Place, to: Place, fraction: number): Place {
  return {
    position: mix(from.position, to.position, fraction),
    rotation: slerp(from.rotation, to.rotation, fraction),
  };
}

/**
 * The planned bodies in the frame of a stage: planned positions count from the reference vertebra's centroid. One whose
 * position is not planned is drawn where it is, turned as planned; without a pose at the stage it is left out.
 */
export function plannedBodies(target: readonly TargetVertebra[], spine: StageSpine): (Body & { isPlaced: boolean })[] {
  const now = new Map(bodiesOf(spine).map((body) => [body.level, body]));
  const origin = now.get(spine.reference_vertebra)?.position ?? [0, 0, 0];
  const orders = new Map(spine.vertebrae.map((state, order) => [state.vertebra, order]));
  return target
    .flatMap((planned) => {
      const angles = vectorOf(planned.angles_deg);
      const offset = vectorOf(planned.position_mm);
      const position = offset === null ? now.get(planned.vertebra)?.position : add(origin, offset);
      const order = orders.get(planned.vertebra);
      if (angles === null || position === undefined || order === undefined) return [];
      const rotation = quaternionOf(rotationFromTilts(angles));
      const [level, size] = [planned.vertebra, bodySize(planned.vertebra)];
      return [{ level, order, status: "measured" as const, position, rotation, size, covariance: null, isPlaced: offset !== null }];
    })
    .sort((a, b) => a.order - b.order);
}

/** The balls around bodies that a picture shows whole, with a margin, mm. */
export function reachesOf(bodies: readonly Body[], margin = 0): Reach[] {
  return bodies.map(({ position, size }) => ({ at: position, mm: margin + 0.8 * Math.max(...size) }));
}

function placeOf(state: VertebraState): Place | null {
  const position = vectorOf(state.position_mm);
  const rotation = matrixOf(state.rotation);
  if (position === null || rotation === null || state.origin === "not_measured") return null;
  return { position, rotation: quaternionOf(rotation) };
}

function gapPosition(bodies: readonly Body[], first: number): Vec3 {
  const above = bodies.filter((body) => body.order < first).at(-1);
  const below = bodies.find((body) => body.order > first);
  if (above && below) return mix(above.position, below.position, 0.5);
  const [end, next] = above ? [above, bodies.at(-2)] : [below, bodies[1]];
  if (end === undefined) return [0, 0, 0];
  const outwards: Vec3 = next ? unit(subtract(end.position, next.position)) : [0, 0, above ? -1 : 1];
  return add(end.position, scale(outwards, BEYOND_MM));
}

const WEAKNESS: readonly Origin[] = ["measured", "interpolated", "assumed", "not_measured"];

function weaker(a: Origin, b: Origin): Origin {
  return WEAKNESS.indexOf(a) > WEAKNESS.indexOf(b) ? a : b;
}
