import { describe, expect, it } from "vitest";

import { type Draft, draftOf, faults, formOf, isoTime } from "../../src/upload/draft";

function file(path: string): { name: string; path: string; content: File } {
  const name = path.split("/").at(-1) ?? "";
  return { name, path, content: new File([name], name) };
}

const FILES = [file("PRE/right.png"), file("PRE/left.png")];
const DRAFT = draftOf(FILES, "c", "");

describe("draftOf", () => {
  it("has the name of the folder, unless one was typed", () => {
    expect(DRAFT.name).toBe("PRE");
    expect(draftOf(FILES, "c", "BASE").name).toBe("BASE");
  });
});

describe("faults", () => {
  it("finds none in a pair with a name and a calibration", () => {
    expect(faults(DRAFT)).toEqual([]);
  });

  it.each<[string, Partial<Draft>, RegExp]>([
    ["no files", { pairs: [], exposures: [] }, /Choose the two images/],
    ["a missing side", { pairs: [{ left: 0, right: null }] }, /no right image/],
    ["one image twice", { pairs: [{ left: 0, right: 0 }] }, /same image twice/],
    ["no name", { name: "" }, /Name the stage/],
    ["a name with a space", { name: "PRE 1" }, /Name the stage/],
    ["no calibration", { calibrationId: "" }, /calibration/],
    ["no time", { capturedAt: "yesterday" }, /not a time/],
    ["one time of two", { exposures: [{ left: "2026-11-21T09:30:00.000", right: "" }] }, /both times/],
    ["too many pairs", { pairs: Array.from({ length: 61 }, () => ({ left: 0, right: 1 })) }, /at most 60/],
  ])("finds %s", (_, values, expected) => {
    expect(faults({ ...DRAFT, ...values }).join(" ")).toMatch(expected);
  });
});

describe("isoTime", () => {
  it("reads times with a zone, and local ones", () => {
    expect(isoTime("2026-11-21T10:30:00.250+01:00")).toBe("2026-11-21T09:30:00.250Z");
    expect(isoTime("2026-11-21 09:30")).toBe(new Date(2026, 10, 21, 9, 30).toISOString());
    expect(isoTime("9:30")).toBeNull();
    expect(isoTime("2026-13-45T99:99")).toBeNull();
  });
});

describe("formOf", () => {
  it("sends each side in the order of the pairs, and no name of a file", async () => {
    const form = formOf({ ...DRAFT, exposures: [{ left: "2026-11-21T09:30:00Z", right: "2026-11-21T09:30:00.004Z" }] }, true);
    const left = form.get("left") as File;
    expect(await left.text()).toBe("left.png");
    expect(left.name).toBe("left");
    expect(form.get("retake")).toBe("true");
    expect(form.get("captured_at")).toBeNull();
    expect(form.getAll("right_exposed_at")).toEqual(["2026-11-21T09:30:00.004Z"]);
  });
});
