import { describe, expect, it } from "vitest";

import { href, parse, paths } from "../../src/app/route";

describe("parse", () => {
  it.each([
    ["", { page: "surgeries" }],
    ["/", { page: "surgeries" }],
    ["/surgeries/a1", { page: "surgery", id: "a1", stage: null }],
    ["/surgeries/a1/stages/PRE", { page: "surgery", id: "a1", stage: "PRE" }],
    ["/surgeries/a1/stages/PRE/images", { page: "images", id: "a1", stage: "PRE" }],
    ["/surgeries/a1/radiographs", { page: "radiographs", id: "a1" }],
    ["/surgeries/a1/setup", { page: "setup", id: "a1" }],
    ["/calibrations", { page: "calibrations" }],
    ["/calibrations/c1", { page: "calibration", id: "c1" }],
    ["/planner", { page: "planner" }],
    ["/planner?range=900/1000", { page: "planner" }],
  ])("reads %s", (path, expected) => {
    expect(parse(path)).toEqual(expected);
  });

  it.each(["/nothing", "/surgeries", "/surgeries/a/b", "/surgeries/a/stages/P/x", "/planner/x", "/calibrations/c/x", "/%zz"])(
    "knows no page %s",
    (path) => {
      expect(parse(path)).toEqual({ page: "unknown", path });
    },
  );

  it("reads what paths writes, whatever the name", () => {
    const name = "a/b <i>#?% ä";
    expect(parse(paths.images(name, name))).toEqual({ page: "images", id: name, stage: name });
  });

  it("writes links within the page", () => {
    expect(href(paths.stage("a", "PRE"))).toBe("#/surgeries/a/stages/PRE");
  });
});
