/** A correction before it is saved: edits in their order, with undo, and what they make of a scene. */
import type { TriadEdits } from "../api/types";
import { type Side, SIDES } from "./camera";
import { centreAt, centreName, type Scene, triadName } from "./scene";
import { distance2, type Vec2 } from "./vectors";

export type Edit =
  | { kind: "label"; triad: number; label: string | null }
  | { kind: "remove-triad"; triad: number }
  | { kind: "move"; side: Side; key: string; to: Vec2 }
  | { kind: "remove-centre"; side: Side; key: string }
  | { kind: "add"; side: Side; key: string; at: Vec2 };

/** Edits and how many of them count; those behind have been undone. */
export interface Draft {
  edits: readonly Edit[];
  count: number;
}

/** Largest number of edits of each kind in one revision. */
export const MAX_EDITS = 60;

export const EMPTY: Draft = { edits: [], count: 0 };

/** The edits that count. */
export function current(draft: Draft): readonly Edit[] {
  return draft.edits.slice(0, draft.count);
}

/** Append an edit; moving the same centre on, or choosing another label, continues the edit before. */
export function appended(draft: Draft, edit: Edit): Draft {
  const before = current(draft);
  const last = before.at(-1);
  const kept = last !== undefined && continues(last, edit) ? before.slice(0, -1) : before;
  const next = last?.kind === "add" && edit.kind === "move" && continues(last, edit) ? { ...last, at: edit.to } : edit;
  return { edits: [...kept, next], count: kept.length + 1 };
}

export function undone(draft: Draft): Draft {
  return { ...draft, count: Math.max(0, draft.count - 1) };
}

export function redone(draft: Draft): Draft {
  return { ...draft, count: Math.min(draft.edits.length, draft.count + 1) };
}

/** The key of the next centre that is added. */
export function nextKey(draft: Draft): string {
  return `n${current(draft).filter((edit) => edit.kind === "add").length + 1}`;
}

/** A scene after a correction: what is removed stays in it, marked. */
export interface EditedScene extends Scene {
  removedTriads: ReadonlySet<number>;
  /** Side and key of the centres that are removed, as in `placeOf`. */
  removedCentres: ReadonlySet<string>;
  editedLabels: ReadonlySet<number>;
  editedCentres: ReadonlySet<string>;
}

export function placeOf(side: Side, key: string): string {
  return `${side}:${key}`;
}

/** What a correction makes of a scene, before the images are matched again. */
export function edited(scene: Scene, draft: Draft): EditedScene {
  const sides = { left: [...scene.left], right: [...scene.right] };
  const triads = [...scene.triads];
  const [removedTriads, editedLabels] = [new Set<number>(), new Set<number>()];
  const [removedCentres, editedCentres] = [new Set<string>(), new Set<string>()];
  for (const edit of current(draft)) {
    if (edit.kind === "label") {
      const triad = triads[edit.triad];
      if (triad === undefined) continue;
      triads[edit.triad] = { ...triad, label: edit.label, labelManual: true, labelReason: null };
      editedLabels.add(edit.triad);
      removedTriads.delete(edit.triad);
    } else if (edit.kind === "remove-triad") {
      removedTriads.add(edit.triad);
      editedLabels.delete(edit.triad);
    } else if (edit.kind === "remove-centre") {
      removedCentres.add(placeOf(edit.side, edit.key));
      if (edit.key.startsWith("n")) sides[edit.side] = sides[edit.side].filter((centre) => centre.key !== edit.key);
    } else {
      const place = edit.kind === "move" ? edit.to : edit.at;
      sides[edit.side] = placed(sides[edit.side], edit.side, edit.key, place);
      editedCentres.add(placeOf(edit.side, edit.key));
      removedCentres.delete(placeOf(edit.side, edit.key));
    }
  }
  return { ...scene, ...sides, triads, removedTriads, removedCentres, editedLabels, editedCentres };
}

/** One change of a correction, for the summary before saving. */
export interface Change {
  text: string;
  detail: string | null;
}

/** What a correction changes, in sentences. */
export function changesOf(scene: Scene, after: EditedScene): Change[] {
  const changes: Change[] = [];
  for (const triad of scene.triads) {
    const name = triadName(triad);
    if (after.removedTriads.has(triad.index)) changes.push({ text: `Remove triad ${name}`, detail: null });
    if (!after.editedLabels.has(triad.index)) continue;
    const label = after.triads[triad.index]?.label ?? null;
    if (label === triad.label) changes.push({ text: label === null ? `Leave ${name} without a label` : `Confirm label ${label}`, detail: null });
    else changes.push({ text: label === null ? `Take away label ${name}` : `Label ${name} as ${label}`, detail: null });
  }
  for (const side of SIDES) {
    for (const centre of after[side]) {
      const place = placeOf(side, centre.key);
      const before = centreAt(scene, side, centre.key);
      const at = `u ${centre.pixel[0].toFixed(1)}, v ${centre.pixel[1].toFixed(1)} px`;
      const name = centreName(scene, centre);
      if (after.removedCentres.has(place)) changes.push({ text: `Remove ball centre ${name}, ${side} image`, detail: null });
      else if (!after.editedCentres.has(place)) continue;
      else if (before === null) changes.push({ text: `Add a ball centre, ${side} image`, detail: at });
      else {
        const by = distance2(before.pixel, centre.pixel).toFixed(1);
        changes.push({ text: `Move ball centre ${name}, ${side} image, by ${by} px`, detail: at });
      }
    }
  }
  return changes;
}

/** What is wrong with a correction, for people; null when it can be saved. */
export function wrongWith(after: EditedScene): string | null {
  const labels = after.triads.flatMap((triad) =>
    triad.label === null || after.removedTriads.has(triad.index) ? [] : [triad.label],
  );
  const twice = labels.find((label, k) => labels.indexOf(label) !== k);
  if (twice !== undefined) return `Two triads are labelled ${twice}. Change or take away one of the labels.`;
  const body = centreEdits(after, 1);
  if (body.length > MAX_EDITS) return `A correction has at most ${MAX_EDITS} ball centres. Save it in parts.`;
  return null;
}

/** The body of the request that saves a correction of a pair of a take; null when nothing is changed. */
export function revisionOf(after: EditedScene, pair: number): TriadEdits | null {
  const labels = [...after.editedLabels].sort(ascending).map((triad) => ({ triad, label: after.triads[triad]?.label ?? null }));
  const removed = [...after.removedTriads].sort(ascending);
  const centres = centreEdits(after, pair);
  if (labels.length + removed.length + centres.length === 0) return null;
  return { kind: "edit", take: after.take, labels, removed, centres };
}

function centreEdits(after: EditedScene, pair: number): NonNullable<TriadEdits["centres"]> {
  return SIDES.flatMap((side) =>
    after[side].flatMap((centre): NonNullable<TriadEdits["centres"]> => {
      const place = placeOf(side, centre.key);
      const [x, y] = centre.pixel;
      if (after.removedCentres.has(place)) {
        return centre.feature === null ? [] : [{ action: "remove", pair, side, feature: centre.feature }];
      }
      if (!after.editedCentres.has(place)) return [];
      return centre.feature === null
        ? [{ action: "add", pair, side, x, y }]
        : [{ action: "move", pair, side, feature: centre.feature, x, y }];
    }),
  );
}

function placed(centres: Scene["left"], side: Side, key: string, pixel: Vec2): Scene["left"] {
  if (centres.some((centre) => centre.key === key)) {
    return centres.map((centre) => (centre.key === key ? { ...centre, pixel, manual: true, covariance: null, score: null } : centre));
  }
  const none = { covariance: null, feature: null, score: null, triad: null, ball: null, reason: null };
  return [...centres, { key, side, pixel, manual: true, ...none }];
}

function continues(last: Edit, edit: Edit): boolean {
  if (edit.kind === "label") return last.kind === "label" && last.triad === edit.triad;
  if (edit.kind !== "move") return false;
  return (last.kind === "move" || last.kind === "add") && last.side === edit.side && last.key === edit.key;
}

function ascending(a: number, b: number): number {
  return a - b;
}
