/** The state of digitizing: landmarks, the one that is placed next, and what can be undone. */
import {
  type CommonDraft,
  type Landmarks,
  nextOpen,
  type Point,
  pointAt,
  sameSlot,
  type Slot,
  slotKey,
  slotsOf,
  type VertebraDraft,
  withPoint,
} from "./landmarks";

const MAX_STEPS = 500;

export interface Editor {
  readonly landmarks: Landmarks;
  /** The landmark that a click places, or that arrow keys move. */
  readonly selected: Slot | null;
  /** Optional landmarks that were passed over. */
  readonly skipped: ReadonlySet<string>;
  readonly past: readonly Step[];
  readonly future: readonly Step[];
}

interface Step {
  readonly landmarks: Landmarks;
  readonly selected: Slot | null;
}

export type Action =
  | { readonly type: "place"; readonly point: Point; readonly stay?: boolean }
  | { readonly type: "nudge"; readonly by: Point }
  | { readonly type: "remove" }
  | { readonly type: "skip" }
  | { readonly type: "select"; readonly slot: Slot | null }
  | { readonly type: "levels"; readonly vertebrae: readonly string[] }
  | { readonly type: "add-common"; readonly common: CommonDraft }
  | { readonly type: "change-common"; readonly name: string; readonly common: CommonDraft }
  | { readonly type: "remove-common"; readonly name: string }
  | { readonly type: "load"; readonly landmarks: Landmarks }
  | { readonly type: "undo" }
  | { readonly type: "redo" };

/** Return an editor of landmarks that waits for the first one that is not placed. */
export function startEditor(landmarks: Landmarks): Editor {
  return { landmarks, selected: nextOpen(landmarks, null), skipped: new Set(), past: [], future: [] };
}

/** The state after an action. */
export function reduce(editor: Editor, action: Action): Editor {
  const { landmarks, selected } = editor;
  switch (action.type) {
    case "select":
      return { ...editor, selected: action.slot };
    case "skip": {
      if (selected === null) return editor;
      const skipped = new Set([...editor.skipped, slotKey(selected)]);
      return { ...editor, skipped, selected: nextOpen(landmarks, selected, skipped) };
    }
    case "place": {
      if (selected === null) return editor;
      const isNew = pointAt(landmarks, selected) === null;
      const placed = withPoint(landmarks, selected, rounded(action.point));
      const next = isNew && !action.stay ? nextOpen(placed, selected, editor.skipped) : selected;
      return changed(editor, placed, next);
    }
    case "nudge": {
      const point = selected === null ? null : pointAt(landmarks, selected);
      if (selected === null || point === null) return editor;
      const moved: Point = [point[0] + action.by[0], point[1] + action.by[1]];
      return changed(editor, withPoint(landmarks, selected, rounded(moved)), selected);
    }
    case "remove":
      if (selected === null || pointAt(landmarks, selected) === null) return editor;
      return changed(editor, withPoint(landmarks, selected, null), selected);
    case "levels":
      return withSelection(changed(editor, { ...landmarks, vertebrae: kept(landmarks, action.vertebrae) }, selected));
    case "add-common":
      return withSelection(changed(editor, { ...landmarks, common: [...landmarks.common, action.common] }, selected));
    case "change-common": {
      const common = landmarks.common.map((each) => (each.name === action.name ? action.common : each));
      return withSelection(changed(editor, { ...landmarks, common }, selected));
    }
    case "remove-common": {
      const common = landmarks.common.filter(({ name }) => name !== action.name);
      return withSelection(changed(editor, { ...landmarks, common }, selected));
    }
    case "load":
      return changed({ ...editor, skipped: new Set() }, action.landmarks, nextOpen(action.landmarks, null));
    case "undo":
      return stepped(editor, editor.past, "past");
    case "redo":
      return stepped(editor, editor.future, "future");
  }
}

function changed(editor: Editor, landmarks: Landmarks, selected: Slot | null): Editor {
  const before: Step = { landmarks: editor.landmarks, selected: editor.selected };
  return { ...editor, landmarks, selected, past: [...editor.past, before].slice(-MAX_STEPS), future: [] };
}

/** Go one step back or forward. */
function stepped(editor: Editor, steps: readonly Step[], from: "past" | "future"): Editor {
  const step = steps.at(-1);
  if (step === undefined) return editor;
  const here: Step = { landmarks: editor.landmarks, selected: editor.selected };
  return from === "past"
    ? { ...editor, ...step, past: steps.slice(0, -1), future: [...editor.future, here] }
    : { ...editor, ...step, future: steps.slice(0, -1), past: [...editor.past, here] };
}

/** Select another slot when the selected one is no more, or none was selected. */
function withSelection(editor: Editor): Editor {
  const exists = slotsOf(editor.landmarks).some((slot) => sameSlot(slot, editor.selected));
  return exists ? editor : { ...editor, selected: nextOpen(editor.landmarks, null, editor.skipped) };
}

function kept(landmarks: Landmarks, names: readonly string[]): VertebraDraft[] {
  return names.map(
    (vertebra) => landmarks.vertebrae.find((each) => each.vertebra === vertebra) ?? { vertebra, pa: {}, lateral: {} },
  );
}

/** Places are kept to a hundredth of a pixel, finer than anybody can point. */
function rounded([u, v]: Point): Point {
  return [Math.round(u * 100) / 100, Math.round(v * 100) / 100];
}
