/** A correction carried over to a newer take, which somebody else made meanwhile. */
import { type Draft, current, type Edit, EMPTY } from "./draft";
import type { Side } from "./camera";
import { type Centre, centreAt, centreName, type Scene, type SceneTriad, triadName } from "./scene";
import { distance2, length, subtract } from "./vectors";

/** Distances within which a triad, mm, and a ball centre, px, of two takes of the same images are the same. */
const SAME_TRIAD_MM = 3;
const SAME_CENTRE_PX = 1;

export interface Rebased {
  draft: Draft;
  /** What cannot be carried over, in sentences. */
  lost: string[];
}

/** Carry a correction of a scene over to another scene of the same images. */
export function rebased(draft: Draft, from: Scene, to: Scene): Rebased {
  const edits: Edit[] = [];
  const lost: string[] = [];
  for (const edit of current(draft)) {
    const next = carried(edit, from, to);
    if (next !== null) edits.push(next);
    else lost.push(lossOf(edit, from));
  }
  return { draft: edits.length === 0 ? EMPTY : { edits, count: edits.length }, lost };
}

/** The same triad in another take; null when it has none there. */
export function sameTriad(triad: SceneTriad, to: Scene): SceneTriad | null {
  let [nearest, least]: [SceneTriad | null, number] = [null, SAME_TRIAD_MM];
  for (const candidate of to.triads) {
    if (triad.position === null || candidate.position === null) continue;
    const distance = length(subtract(triad.position, candidate.position));
    if (distance < least) [nearest, least] = [candidate, distance];
  }
  return nearest;
}

function carried(edit: Edit, from: Scene, to: Scene): Edit | null {
  if (edit.kind === "add") return edit;
  if (edit.kind === "label" || edit.kind === "remove-triad") {
    const triad = from.triads[edit.triad];
    const same = triad === undefined ? null : sameTriad(triad, to);
    return same === null ? null : { ...edit, triad: same.index };
  }
  if (edit.key.startsWith("n")) return edit;
  const same = sameCentre(centreAt(from, edit.side, edit.key), edit.side, to);
  return same === null ? null : { ...edit, key: same.key };
}

function sameCentre(centre: Centre | null, side: Side, to: Scene): Centre | null {
  let [nearest, least]: [Centre | null, number] = [null, SAME_CENTRE_PX];
  for (const candidate of to[side]) {
    if (centre === null || candidate.feature === null) continue;
    const distance = distance2(centre.pixel, candidate.pixel);
    if (distance < least) [nearest, least] = [candidate, distance];
  }
  return nearest;
}

function lossOf(edit: Edit, from: Scene): string {
  if (edit.kind === "label" || edit.kind === "remove-triad") {
    const triad = from.triads[edit.triad];
    return `${triad === undefined ? "A triad" : triadName(triad)} is not in the newer take.`;
  }
  const centre = centreAt(from, edit.side, edit.key);
  return `${centre === null ? "A ball centre" : `Ball centre ${centreName(from, centre)}`} of the ${edit.side} image is not in the newer take.`;
}
