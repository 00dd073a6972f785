import { describe, expect, it } from "vitest";

import type { StageSpine } from "../../src/api/types";
import { tsv } from "../../src/measures/table-text";
import { ANATOMICAL, flagsOf, nextSorting, rowsWithoutMotion, sorted, vertebraRows, vertebraTable } from "../../src/measures/vertebrae";
import { motion } from "./builders";

const NOTHING = { origin: "not_measured", reason: "no triad", translation_mm: [null, null, null], translation_sd_mm: [null, null, null], derotation_deg: null, derotation_sd_deg: null } as const;
const FLAGS = [
  { code: "ball-occluded", detail: "left: a ball of T1 is hidden" },
  { code: "neighbours-disagree", detail: "T10, between T9 and T11, moved" },
];
const SPINE = {
  reference_vertebra: "T10",
  vertebrae: [{ vertebra: "T1", marked: false }, { vertebra: "T9", marked: true }, { vertebra: "T10", marked: true }],
} as unknown as StageSpine;
const ROWS = vertebraRows(
  SPINE,
  [motion("T1", { ...NOTHING, translation_mm: [null, null, null], translation_sd_mm: [null, null, null] }), motion("T9", { derotation_deg: -8 }), motion("T10", { origin: "interpolated" })],
  FLAGS,
);
const names = (rows: typeof ROWS): string[] => rows.map((row) => row.vertebra);

describe("rows of vertebrae", () => {
  it("have values with their deviations by axis", () => {
    expect(ROWS[1]?.values.y).toEqual({ value: -2, sd: 0.2 });
    expect(ROWS[1]?.values.distraction).toEqual({ value: 7, sd: 0.7 });
    expect(ROWS[0]?.values.x).toEqual({ value: null, sd: null });
    expect(ROWS[0]?.reason).toBe("no triad");
  });
  it("tell which have a marker of their own, and which is the reference", () => {
    expect(ROWS.map((row) => [row.marked, row.isReference])).toEqual([[false, false], [true, false], [true, true]]);
  });
  it("have the flags that name them, and not those of a longer name", () => {
    expect(ROWS.map((row) => row.flags.map((flag) => flag.code))).toEqual([["ball-occluded"], ["neighbours-disagree"], ["neighbours-disagree"]]);
    expect(flagsOf("T1", [{ code: "x", detail: "T11 and XT1" }])).toEqual([]);
  });
  it("are those of the stage where nothing has moved yet", () => {
    const spine = { vertebrae: [{ vertebra: "T7", origin: "assumed" }] } as unknown as StageSpine;
    const [row] = rowsWithoutMotion(spine, "first stage", []);
    expect(row).toMatchObject({ vertebra: "T7", status: "assumed", reason: "first stage" });
    expect(row?.values.coronal.value).toBeNull();
  });
});

describe("sorting", () => {
  it("puts rows without a value last in both directions", () => {
    expect(names(sorted(ROWS, { key: "derotation", descending: false }))).toEqual(["T9", "T10", "T1"]);
    expect(names(sorted(ROWS, { key: "derotation", descending: true }))).toEqual(["T10", "T9", "T1"]);
  });
  it("is anatomical at first, and stays so among equals", () => {
    expect(names(sorted(ROWS, ANATOMICAL))).toEqual(["T1", "T9", "T10"]);
    expect(names(sorted(ROWS, { key: "x", descending: true }))).toEqual(["T9", "T10", "T1"]);
    expect(names(sorted(ROWS, { key: "status", descending: false }))).toEqual(["T9", "T10", "T1"]);
    expect(names(sorted(ROWS, { key: "flags", descending: false }))).toEqual(["T1", "T9", "T10"]);
  });
  it("goes up, down and back to the anatomical order", () => {
    const up = nextSorting(ANATOMICAL, "x");
    const down = nextSorting(up, "x");
    expect([up.descending, down.descending]).toEqual([false, true]);
    expect(nextSorting(down, "x")).toEqual(ANATOMICAL);
    expect(nextSorting(ANATOMICAL, "vertebra")).toEqual({ key: "vertebra", descending: true });
  });
});

describe("tables as text", () => {
  it("have one line for each row at full precision", () => {
    const table = vertebraTable(ROWS);
    const lines = tsv(table.header, table.rows).split("\n");
    expect(lines).toHaveLength(5);
    expect(lines[0]?.split("\t").slice(0, 5)).toEqual(["vertebra", "status", "own_marker", "x_mm", "x_sd_mm"]);
    expect(lines[1]?.split("\t").slice(0, 5)).toEqual(["T1", "not_measured", "false", "", ""]);
    expect(lines[2]?.split("\t")[9]).toBe("-8");
    expect(new Set(lines.slice(0, 4).map((line) => line.split("\t").length)).size).toBe(1);
  });
  it("cannot be broken or become formulas by what is in a cell", () => {
    expect(tsv(["a"], [["=1+1"], ["x\ty\nz"], [-1], [Number.NaN], [null]])).toBe("a\n'=1+1\nx y z\n-1\n\n\n");
  });
});
