/** Landmarks of vertebrae and common points on two radiographs: what there is to place, and in which order. */

export type View = "pa" | "lateral";
/** A place in an image (u, v), px: u to the right, v down, integers are centres of pixels. */
export type Point = readonly [number, number];

export interface LandmarkKind {
  readonly name: string;
  readonly label: string;
  /** Whether a fit is possible without it. */
  readonly optional: boolean;
  /** The end plate that it is an end of. */
  readonly plate: "superior" | "inferior" | null;
}

function corner(plate: "superior" | "inferior", side: string): LandmarkKind {
  const place = plate === "superior" ? "upper" : "lower";
  return { name: `${plate}_${side}`, label: `${side} end of the ${place} end plate`, optional: false, plate };
}

function pedicle(side: string): LandmarkKind {
  return { name: `pedicle_${side}`, label: `centre of the ${side} pedicle`, optional: true, plate: null };
}

/** Landmarks of a vertebra in the order in which they are placed; sides are the patient's. */
export const KINDS: Readonly<Record<View, readonly LandmarkKind[]>> = {
  pa: [
    corner("superior", "left"),
    corner("superior", "right"),
    corner("inferior", "left"),
    corner("inferior", "right"),
    pedicle("left"),
    pedicle("right"),
  ],
  lateral: [
    corner("superior", "anterior"),
    corner("superior", "posterior"),
    corner("inferior", "anterior"),
    corner("inferior", "posterior"),
  ],
};

/** Names of the views for people. */
export const VIEW_NAMES: Readonly<Record<View, string>> = { pa: "PA", lateral: "lateral" };

export interface VertebraDraft {
  readonly vertebra: string;
  readonly pa: Readonly<Record<string, Point>>;
  readonly lateral: Readonly<Record<string, Point>>;
}

/** Where the cameras see a common point: the triad of a vertebra, or a place in object space. */
export type CommonPlace =
  | { readonly kind: "triad"; readonly triad: string }
  | { readonly kind: "object"; readonly mm: readonly [number, number, number]; readonly sdMm: number };

export interface CommonDraft {
  readonly name: string;
  readonly place: CommonPlace;
  readonly pa: Point | null;
  readonly lateral: Point | null;
}

export interface Landmarks {
  /** Cranial first. */
  readonly vertebrae: readonly VertebraDraft[];
  readonly common: readonly CommonDraft[];
}

/** One landmark that may be placed: of a vertebra, or a common point. */
export type Slot =
  | { readonly kind: "vertebra"; readonly view: View; readonly vertebra: string; readonly name: string }
  | { readonly kind: "common"; readonly view: View; readonly name: string };

/** Return landmarks without any place. */
export function emptyLandmarks(vertebrae: readonly string[]): Landmarks {
  return { vertebrae: vertebrae.map((vertebra) => ({ vertebra, pa: {}, lateral: {} })), common: [] };
}

/** A text that names a slot. */
export function slotKey(slot: Slot): string {
  return slot.kind === "common" ? `${slot.view}/common/${slot.name}` : `${slot.view}/${slot.vertebra}/${slot.name}`;
}

/** Whether two slots are the same. */
export function sameSlot(a: Slot | null, b: Slot | null): boolean {
  return a === null || b === null ? a === b : slotKey(a) === slotKey(b);
}

/** A slot as people read it: `T9: left end of the upper end plate`. */
export function slotLabel(slot: Slot): string {
  if (slot.kind === "common") return `common point ${slot.name}`;
  const kind = KINDS[slot.view].find((each) => each.name === slot.name);
  return `${slot.vertebra}: ${kind?.label ?? slot.name}`;
}

/** All slots in the guided order: one radiograph from the head down with its common points, then the other. */
export function slotsOf(landmarks: Landmarks): Slot[] {
  return (["pa", "lateral"] as const).flatMap((view) => [
    ...landmarks.vertebrae.flatMap(({ vertebra }) =>
      KINDS[view].map(({ name }): Slot => ({ kind: "vertebra", view, vertebra, name })),
    ),
    ...landmarks.common.map(({ name }): Slot => ({ kind: "common", view, name })),
  ]);
}

/** Where a slot was placed; null while it was not. */
export function pointAt(landmarks: Landmarks, slot: Slot): Point | null {
  if (slot.kind === "common") return landmarks.common.find(({ name }) => name === slot.name)?.[slot.view] ?? null;
  return landmarks.vertebrae.find(({ vertebra }) => vertebra === slot.vertebra)?.[slot.view][slot.name] ?? null;
}

/** The same landmarks with one placed, or taken away by null. */
export function withPoint(landmarks: Landmarks, slot: Slot, point: Point | null): Landmarks {
  if (slot.kind === "common") {
    const common = landmarks.common.map((each) => (each.name === slot.name ? { ...each, [slot.view]: point } : each));
    return { ...landmarks, common };
  }
  const vertebrae = landmarks.vertebrae.map((each) => {
    if (each.vertebra !== slot.vertebra) return each;
    const { [slot.name]: _, ...others } = each[slot.view];
    return { ...each, [slot.view]: point === null ? others : { ...others, [slot.name]: point } };
  });
  return { ...landmarks, vertebrae };
}

/** The first slot after one, in the guided order and around its end, that is not placed; null when all are. */
export function nextOpen(landmarks: Landmarks, after: Slot | null, skipped: ReadonlySet<string> = new Set()): Slot | null {
  const slots = slotsOf(landmarks);
  const start = after === null ? 0 : slots.findIndex((slot) => sameSlot(slot, after)) + 1;
  const ordered = [...slots.slice(start), ...slots.slice(0, start)];
  return ordered.find((slot) => pointAt(landmarks, slot) === null && !skipped.has(slotKey(slot))) ?? null;
}

/** The slot before or after one in the guided order. */
export function neighbour(landmarks: Landmarks, slot: Slot | null, step: 1 | -1): Slot | null {
  const slots = slotsOf(landmarks);
  if (slots.length === 0) return null;
  const index = slot === null ? -1 : slots.findIndex((each) => sameSlot(each, slot));
  return slots[(Math.max(index, step === 1 ? -1 : 0) + step + slots.length) % slots.length] ?? null;
}

/** How many slots are placed, and how many there are, without optional ones. */
export function progress(landmarks: Landmarks, view: View): { placed: number; needed: number } {
  const needed = slotsOf(landmarks).filter((slot) => slot.view === view && !isOptional(slot));
  return { placed: needed.filter((slot) => pointAt(landmarks, slot) !== null).length, needed: needed.length };
}

/** Whether a fit is possible without a slot. */
export function isOptional(slot: Slot): boolean {
  return slot.kind === "vertebra" && (KINDS[slot.view].find(({ name }) => name === slot.name)?.optional ?? false);
}
