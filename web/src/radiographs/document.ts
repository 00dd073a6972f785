/** Landmarks as the API has them, and what is still wrong with them. */
import type { CommonLandmark, InitialRadiographs, VertebraLandmarks } from "../api/types";
import { type Geometry, toPlane } from "./geometry";
import { type CommonDraft, KINDS, type Landmarks, type Point, type Slot, VIEW_NAMES, type View } from "./landmarks";

export const MIN_COMMON = 3;
export const MIN_VERTEBRAE = 2;

/** Something that keeps the landmarks from being fitted, and the landmark to look at. */
export interface Fault {
  readonly text: string;
  readonly slot: Slot | null;
}

export interface RadiographPair {
  readonly pa: string;
  readonly lateral: string;
}

/** Landmarks of the API as a draft. */
export function fromDocument(initial: InitialRadiographs): Landmarks {
  return {
    vertebrae: initial.vertebrae.map(({ vertebra, pa, lateral }) => ({
      vertebra,
      pa: known(pa as unknown as Record<string, number[] | null>),
      lateral: known(lateral as unknown as Record<string, number[] | null>),
    })),
    common: initial.common.map((common): CommonDraft => {
      const mm = common.object_mm;
      return {
        name: common.name,
        place:
          mm != null
            ? { kind: "object", mm: [mm[0] ?? 0, mm[1] ?? 0, mm[2] ?? 0], sdMm: common.object_sd_mm ?? 0 }
            : { kind: "triad", triad: common.triad ?? "" },
        pa: asPoint(common.pa),
        lateral: asPoint(common.lateral),
      };
    }),
  };
}

/** A draft as the API takes it, or the faults that prevent it. */
export function toDocument(
  landmarks: Landmarks,
  radiographs: RadiographPair,
  geometry: Geometry,
  sdPx: number,
): { initial: InitialRadiographs; faults: readonly [] } | { initial: null; faults: readonly Fault[] } {
  const faults = faultsOf(landmarks, geometry);
  if (faults.length > 0) return { initial: null, faults };
  return { initial: assembled(landmarks, radiographs, sdPx), faults: [] };
}

/** Whether every landmark that a fit needs is placed. */
export function isComplete(landmarks: Landmarks): boolean {
  if (landmarks.vertebrae.length < MIN_VERTEBRAE || landmarks.common.length < MIN_COMMON) return false;
  return (["pa", "lateral"] as const).every((view) => missing(landmarks, view).length === 0);
}

/** Complete landmarks as the API takes them. */
export function assembled(landmarks: Landmarks, radiographs: RadiographPair, sdPx: number): InitialRadiographs {
  const vertebrae = landmarks.vertebrae.map(
    ({ vertebra, pa, lateral }) => ({ vertebra, pa: paired(pa), lateral }) as unknown as VertebraLandmarks,
  );
  const common = landmarks.common.map(({ name, place, pa, lateral }): CommonLandmark => {
    const seen =
      place.kind === "triad"
        ? { triad: place.triad, object_mm: null, object_sd_mm: 0 }
        : { triad: null, object_mm: [...place.mm], object_sd_mm: place.sdMm };
    return { name, pa: [...(pa ?? [])], lateral: [...(lateral ?? [])], ...seen };
  });
  return { kind: "radiographs", ...radiographs, vertebrae, common, landmark_sd_px: sdPx };
}

/** What keeps landmarks from being fitted: the same rules as the service has, found while they are placed. */
export function faultsOf(landmarks: Landmarks, geometry: Geometry): Fault[] {
  const faults: Fault[] = [];
  if (landmarks.vertebrae.length < MIN_VERTEBRAE) faults.push({ text: "digitize at least two vertebrae", slot: null });
  if (landmarks.common.length < MIN_COMMON) {
    faults.push({ text: "add common points until there are three, not on one line", slot: null });
  }
  for (const view of ["pa", "lateral"] as const) {
    faults.push(...missing(landmarks, view), ...exchanged(landmarks, view, geometry), ...disordered(landmarks, view, geometry));
  }
  return faults;
}

function missing(landmarks: Landmarks, view: View): Fault[] {
  const faults: Fault[] = [];
  for (const { vertebra, [view]: points } of landmarks.vertebrae) {
    const open = KINDS[view].filter(({ name, optional }) => !optional && points[name] === undefined);
    const first = open[0];
    if (first === undefined) continue;
    const slot: Slot = { kind: "vertebra", view, vertebra, name: first.name };
    faults.push({ text: `${vertebra}: ${open.length} of 4 corners missing in the ${VIEW_NAMES[view]} view`, slot });
  }
  for (const { name, [view]: point } of landmarks.common) {
    if (point !== null) continue;
    faults.push({ text: `${name}: not placed in the ${VIEW_NAMES[view]} view`, slot: { kind: "common", view, name } });
  }
  return faults;
}

/** Landmarks that lie on the other side of their counterparts than they should. */
function exchanged(landmarks: Landmarks, view: View, geometry: Geometry): Fault[] {
  const [positive, negative] = view === "pa" ? ["left", "right"] : ["anterior", "posterior"];
  const pairs = [
    [`superior_${positive}`, `superior_${negative}`, 0],
    [`inferior_${positive}`, `inferior_${negative}`, 0],
    ...(view === "pa" ? [["pedicle_left", "pedicle_right", 0] as const] : []),
    [`superior_${positive}`, `inferior_${positive}`, 1],
    [`superior_${negative}`, `inferior_${negative}`, 1],
  ] as const;
  const faults: Fault[] = [];
  for (const { vertebra, [view]: points } of landmarks.vertebrae) {
    for (const [more, less, axis] of pairs) {
      const a = points[more];
      const b = points[less];
      if (a === undefined || b === undefined) continue;
      if (toPlane(geometry[view], a)[axis] > toPlane(geometry[view], b)[axis]) continue;
      const what = `${more.replace("_", " ")} and ${less.replace("_", " ")}`;
      const slot: Slot = { kind: "vertebra", view, vertebra, name: more };
      faults.push({ text: `${vertebra}: ${what} look exchanged in the ${VIEW_NAMES[view]} view`, slot });
    }
  }
  return faults;
}

/** Vertebrae that lie above one that is more cranial. */
function disordered(landmarks: Landmarks, view: View, geometry: Geometry): Fault[] {
  const faults: Fault[] = [];
  let above: { vertebra: string; height: number } | null = null;
  for (const { vertebra, [view]: points } of landmarks.vertebrae) {
    const corners = KINDS[view].filter(({ plate }) => plate !== null).map(({ name }) => points[name]);
    if (corners.some((point) => point === undefined)) continue;
    const heights = corners.map((point) => toPlane(geometry[view], point as Point)[1]);
    const height = heights.reduce((sum, each) => sum + each, 0) / heights.length;
    if (above !== null && above.height <= height) {
      const slot: Slot = { kind: "vertebra", view, vertebra, name: KINDS[view][0]?.name ?? "" };
      faults.push({ text: `${vertebra} lies above ${above.vertebra} in the ${VIEW_NAMES[view]} view`, slot });
    }
    above = { vertebra, height };
  }
  return faults;
}

/** A single pedicle says nothing of the rotation and is left out. */
function paired(points: Readonly<Record<string, Point>>): Record<string, Point> {
  const { pedicle_left: left, pedicle_right: right, ...corners } = points;
  return left === undefined || right === undefined ? corners : { ...corners, pedicle_left: left, pedicle_right: right };
}

function known(points: Readonly<Record<string, number[] | null>>): Record<string, Point> {
  const found: Record<string, Point> = {};
  for (const [name, value] of Object.entries(points)) {
    const point = asPoint(value);
    if (point !== null) found[name] = point;
  }
  return found;
}

function asPoint(value: readonly number[] | null | undefined): Point | null {
  return value?.[0] === undefined || value[1] === undefined ? null : [value[0], value[1]];
}
