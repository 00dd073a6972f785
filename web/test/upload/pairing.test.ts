import { describe, expect, it } from "vitest";

import { assign, exchange, foldersOf, type NamedFile, pairFiles, sideOf, stageNameOf } from "../../src/upload/pairing";

function files(...paths: string[]): NamedFile[] {
  return paths.map((path) => ({ path, name: path.split("/").at(-1) ?? "" }));
}

/** The pairs by the paths of their files. */
function named(...paths: string[]): (string | null)[][] {
  const name = (index: number | null): string | null => (index === null ? null : (paths[index] ?? null));
  return pairFiles(files(...paths)).pairs.map(({ left, right }) => [name(left), name(right)]);
}

describe("sideOf", () => {
  it.each([
    ["left.png", "left"],
    ["PRE/right.png", "right"],
    ["POST_L.tif", "left"],
    ["R001.png", "right"],
    ["PREleft.png", "left"],
    ["links_3.ras", "left"],
    ["right/0001.png", "right"],
    ["right/left_0001.png", "left"],
    ["control.png", null],
    ["normal.png", null],
    ["left_right.png", null],
    ["T11.png", null],
  ])("%s is %s", (path, side) => {
    expect(sideOf(path)).toBe(side);
  });
});

describe("pairFiles", () => {
  it("pairs two files by their names, in any order", () => {
    expect(named("PRE/right.png", "PRE/left.png")).toEqual([["PRE/left.png", "PRE/right.png"]]);
  });

  it("pairs a burst by number, 2 before 10", () => {
    expect(named("b_R_10.png", "b_L_2.png", "b_L_10.png", "b_R_2.png")).toEqual([
      ["b_L_2.png", "b_R_2.png"],
      ["b_L_10.png", "b_R_10.png"],
    ]);
  });

  it("pairs folders of both sides", () => {
    expect(named("left/1.png", "left/2.png", "right/1.png", "right/2.png")).toEqual([
      ["left/1.png", "right/1.png"],
      ["left/2.png", "right/2.png"],
    ]);
  });

  it("pairs by order where numbers differ", () => {
    expect(named("L_100.png", "L_102.png", "R_101.png", "R_103.png")).toEqual([
      ["L_100.png", "R_101.png"],
      ["L_102.png", "R_103.png"],
    ]);
  });

  it("leaves a place empty where a file is missing", () => {
    expect(named("L1.png", "L2.png", "R1.png")).toEqual([
      ["L1.png", "R1.png"],
      ["L2.png", null],
    ]);
  });

  it("takes the order of the names, and says so, where they name no side", () => {
    const found = pairFiles(files("b.png", "a.png"));
    expect(found).toEqual({ pairs: [{ left: 1, right: 0 }], guessed: true });
  });

  it("has no pairs of no files", () => {
    expect(pairFiles([])).toEqual({ pairs: [], guessed: false });
  });
});

describe("stageNameOf", () => {
  it.each([
    [["PRE/left.png", "PRE/right.png"], "PRE"],
    [["D1/POST/left/1.png", "D1/POST/right/1.png"], "POST"],
    [["INTER_left.png", "INTER_right.png"], "INTER"],
    [["INTER_L_01.png", "INTER_R_02.png"], "INTER"],
    [["left.png", "right.png"], ""],
    [["a/left.png", "b/right.png"], ""],
    [["<b>/left.png", "<b>/right.png"], ""],
  ])("of %s is %s", (paths, name) => {
    expect(stageNameOf(files(...paths))).toBe(name);
  });
});

it("folders are those of the stages", () => {
  expect(foldersOf(files("D1/PRE/left.png", "D1/POST/left.png", "D1/PRE/right.png"))).toEqual(["POST", "PRE"]);
});

describe("assign", () => {
  const pairs = [
    { left: 0, right: 1 },
    { left: 2, right: 3 },
  ];

  it("exchanges with the place where the file was", () => {
    expect(assign(pairs, 0, "left", 3)).toEqual([
      { left: 3, right: 1 },
      { left: 2, right: 0 },
    ]);
  });

  it("exchanges the sides of a pair", () => {
    expect(assign(pairs, 0, "left", 1)[0]).toEqual({ left: 1, right: 0 });
    expect(exchange(pairs, 1)).toEqual([pairs[0], { left: 3, right: 2 }]);
    expect(exchange(pairs, null)[0]).toEqual({ left: 1, right: 0 });
  });

  it("empties a place", () => {
    expect(assign(pairs, 1, "right", null)[1]).toEqual({ left: 2, right: null });
  });
});
