import { describe, expect, test } from "vitest";

import { type Editor, reduce, startEditor } from "../../src/radiographs/editor";
import { emptyLandmarks, type Landmarks, nextOpen, pointAt, progress, type Slot, slotKey, slotsOf, withPoint } from "../../src/radiographs/landmarks";

const TWO = emptyLandmarks(["T9", "T10"]);
const SCREW = { name: "screw 1", place: { kind: "triad", triad: "T9" }, pa: null, lateral: null } as const;

function placed(landmarks: Landmarks): Landmarks {
  return slotsOf(landmarks).reduce((all, slot, index) => withPoint(all, slot, [index, index + 1]), landmarks);
}

describe("the guided order", () => {
  test("goes down one radiograph with its common points, then the other", () => {
    const slots = slotsOf({ ...TWO, common: [SCREW] }).map(slotKey);
    expect(slots).toHaveLength(2 * 6 + 1 + 2 * 4 + 1);
    expect(slots[0]).toBe("pa/T9/superior_left");
    expect(slots[6]).toBe("pa/T10/superior_left");
    expect(slots[12]).toBe("pa/common/screw 1");
    expect(slots[13]).toBe("lateral/T9/superior_anterior");
  });

  test("continues after a landmark and around the end, past what is placed or not visible", () => {
    const last: Slot = { kind: "vertebra", view: "lateral", vertebra: "T10", name: "inferior_posterior" };
    expect(slotKey(nextOpen(TWO, last) as Slot)).toBe("pa/T9/superior_left");
    const first = slotsOf(TWO)[0] as Slot;
    const one = withPoint(TWO, first, [1, 2]);
    expect(slotKey(nextOpen(one, null, new Set(["pa/T9/superior_right"])) as Slot)).toBe("pa/T9/inferior_left");
    expect(nextOpen(placed(TWO), null)).toBeNull();
  });

  test("counts what a fit needs, without pedicles", () => {
    expect(progress(TWO, "pa")).toEqual({ placed: 0, needed: 8 });
    expect(progress(placed(TWO), "lateral")).toEqual({ placed: 8, needed: 8 });
  });
});

describe("the editor", () => {
  const place = (editor: Editor, u: number, v: number): Editor => reduce(editor, { type: "place", point: [u, v] });

  test("places the selected landmark and goes on to the next", () => {
    const editor = place(startEditor(TWO), 10.123, 20.456);
    expect(editor.landmarks.vertebrae[0]?.pa["superior_left"]).toEqual([10.12, 20.46]);
    expect(slotKey(editor.selected as Slot)).toBe("pa/T9/superior_right");
  });

  test("moves a landmark that is placed already and stays with it", () => {
    const first = slotsOf(TWO)[0] as Slot;
    const editor = place(reduce(place(startEditor(TWO), 1, 2), { type: "select", slot: first }), 5, 6);
    expect(pointAt(editor.landmarks, first)).toEqual([5, 6]);
    expect(editor.selected).toEqual(first);
  });

  test("nudges by tenths of a pixel without growing errors of addition", () => {
    const first = slotsOf(TWO)[0] as Slot;
    let editor = reduce(place(startEditor(TWO), 1, 2), { type: "select", slot: first });
    for (let step = 0; step < 30; step += 1) editor = reduce(editor, { type: "nudge", by: [0.1, -0.1] });
    expect(pointAt(editor.landmarks, first)).toEqual([4, -1]);
  });

  test("undoes and redoes, and forgets what was undone after a change", () => {
    let editor = place(place(startEditor(TWO), 1, 1), 2, 2);
    editor = reduce(editor, { type: "undo" });
    expect(slotKey(editor.selected as Slot)).toBe("pa/T9/superior_right");
    expect(pointAt(editor.landmarks, editor.selected as Slot)).toBeNull();
    expect(pointAt(reduce(editor, { type: "redo" }).landmarks, slotsOf(TWO)[1] as Slot)).toEqual([2, 2]);
    editor = place(editor, 3, 3);
    expect(reduce(editor, { type: "redo" })).toBe(editor);
    const fresh = startEditor(TWO);
    expect(reduce(fresh, { type: "undo" })).toBe(fresh);
  });

  test("passes over a pedicle that is not visible", () => {
    const slot: Slot = { kind: "vertebra", view: "pa", vertebra: "T9", name: "pedicle_left" };
    const editor = reduce(reduce(startEditor(TWO), { type: "select", slot }), { type: "skip" });
    expect(slotKey(editor.selected as Slot)).toBe("pa/T9/pedicle_right");
    expect(nextOpen(editor.landmarks, { ...slot, name: "inferior_right" }, editor.skipped)).toEqual(editor.selected);
  });

  test("keeps the landmarks of vertebrae that stay, and selects another when one goes", () => {
    const editor = reduce(place(startEditor(TWO), 1, 2), { type: "levels", vertebrae: ["T8", "T9"] });
    expect(editor.landmarks.vertebrae.map(({ vertebra }) => vertebra)).toEqual(["T8", "T9"]);
    expect(editor.landmarks.vertebrae[1]?.pa["superior_left"]).toEqual([1, 2]);
    const gone = reduce(editor, { type: "levels", vertebrae: ["T8"] });
    expect(slotKey(gone.selected as Slot)).toBe("pa/T8/superior_left");
  });

  test("adds and removes common points", () => {
    const added = reduce(startEditor(placed(TWO)), { type: "add-common", common: SCREW });
    expect(slotKey(added.selected as Slot)).toBe("pa/common/screw 1");
    expect(place(added, 7, 8).landmarks.common[0]?.pa).toEqual([7, 8]);
    expect(reduce(added, { type: "remove-common", name: "screw 1" }).landmarks.common).toEqual([]);
  });

  test("ignores actions without a landmark", () => {
    const full = startEditor(placed(TWO));
    expect(full.selected).toBeNull();
    for (const action of [{ type: "place", point: [1, 1] }, { type: "nudge", by: [1, 1] }, { type: "remove" }, { type: "skip" }] as const) {
      expect(reduce(full, action)).toBe(full);
    }
  });
});
