import { describe, expect, test } from "vitest";

import { forgetDraft, keepDraft, keptDraft } from "../../src/radiographs/draft-store";
import { actionOf, stepOf } from "../../src/radiographs/keys";
import { emptyLandmarks } from "../../src/radiographs/landmarks";
import { cranialFirst, levelsOf, span } from "../../src/radiographs/levels";
import { spacingText } from "../../src/radiographs/spacing";

const KEY = { key: "", shiftKey: false, ctrlKey: false, metaKey: false, altKey: false };

describe("keys", () => {
  test("arrows move by a tenth, one, ten and a hundred pixels", () => {
    expect([stepOf(KEY), stepOf({ ...KEY, shiftKey: true }), stepOf({ ...KEY, ctrlKey: true })]).toEqual([0.1, 1, 10]);
    expect(stepOf({ ...KEY, ctrlKey: true, shiftKey: true })).toBe(100);
    expect(actionOf({ ...KEY, key: "ArrowUp", shiftKey: true })).toEqual({ type: "move", by: [0, -1] });
  });

  test("control keys undo and redo, and everything else is left to the browser", () => {
    expect(actionOf({ ...KEY, key: "z", ctrlKey: true })).toEqual({ type: "undo" });
    expect(actionOf({ ...KEY, key: "Z", metaKey: true, shiftKey: true })).toEqual({ type: "redo" });
    expect(actionOf({ ...KEY, key: "n", ctrlKey: true })).toBeNull();
    expect(actionOf({ ...KEY, key: "n" })).toEqual({ type: "next" });
    expect(actionOf({ ...KEY, key: "Tab" })).toBeNull();
    expect(actionOf({ ...KEY, key: "ArrowLeft", altKey: true })).toBeNull();
  });
});

describe("levels", () => {
  test("are in anatomical order with what a surgery declares besides", () => {
    expect(levelsOf()).toHaveLength(25);
    expect(levelsOf(["L6"])).toContain("L6");
    expect(cranialFirst(["L1", "T9", "C7", "T10"])).toEqual(["C7", "T9", "T10", "L1"]);
  });

  test("span from the most cranial to the most caudal", () => {
    expect(span(["L1", "T11", "T12"])).toEqual(["T11", "T12", "L1"]);
    expect(span(["T12", "L1"], ["T13"])).toEqual(["T12", "T13", "L1"]);
    expect(span([])).toEqual([]);
  });
});

test("the spacing is row before column, with a point, and never guessed", () => {
  expect(spacingText(" 0,143 ", "0.15")).toEqual({ state: "given", text: "0.143,0.15" });
  expect(spacingText("", "")).toEqual({ state: "none" });
  for (const [rows, columns] of [["0.1", ""], ["0", "0.1"], ["-1", "0.1"], ["1e3", "0.1"], ["abc", "0.1"]] as const) {
    expect(spacingText(rows, columns).state).toBe("wrong");
  }
});

test("a draft is kept per surgery until it is forgotten", () => {
  const draft = { pa: "p", lateral: "l", sdPx: 1, stage: null, landmarks: emptyLandmarks(["T9"]) };
  keepDraft("one", draft);
  expect(keptDraft("one")).toEqual(draft);
  expect(keptDraft("two")).toBeNull();
  forgetDraft("one");
  expect(keptDraft("one")).toBeNull();
});
