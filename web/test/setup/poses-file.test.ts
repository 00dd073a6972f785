import { describe, expect, test } from "vitest";

import { CSV_HEAD, parsePoses, parseTarget } from "../../src/setup/poses-file";

const HEAD = "vertebra,x_mm,y_mm,z_mm,coronal_deg,sagittal_deg,axial_deg";

describe("poses", () => {
  test("come from CSV, with deviations where they are given", () => {
    const { items } = parsePoses(`\ufeff${CSV_HEAD}\r\nT7,0,-2,180,12.5,20,4,0.5,1\r\nT9,0,8,120,4,12,8,,\r\n`);
    expect(items).toEqual([
      { vertebra: "T7", position_mm: [0, -2, 180], angles_deg: [12.5, 20, 4], position_sd_mm: 0.5, rotation_sd_deg: 1 },
      { vertebra: "T9", position_mm: [0, 8, 120], angles_deg: [4, 12, 8], position_sd_mm: 0, rotation_sd_deg: 0 },
    ]);
  });

  test("may have semicolons and decimal commas", () => {
    const { items } = parsePoses(`${HEAD.replaceAll(",", ";")}\nT7;0;0;1,5;0;0;0`);
    expect(items?.[0]?.position_mm).toEqual([0, 0, 1.5]);
  });

  test("come from JSON", () => {
    const pose = { vertebra: "T7", position_mm: [1, 2, 3], angles_deg: [0, 0, 0] };
    expect(parsePoses(JSON.stringify({ poses: [pose] })).items).toEqual([pose]);
    expect(parsePoses(JSON.stringify([pose])).items).toEqual([pose]);
  });

  test.each([
    ["", "empty"],
    ["vertebra,x_mm\nT7,1", "lacks y_mm"],
    [HEAD, "nothing else"],
    [`${HEAD},colour\nT7,0,0,0,0,0,0,red`, "not known"],
    [`${HEAD}\nT7,0,0,0,0,0`, "Line 2 has 6 columns"],
    [`${HEAD}\nT7,0,0,0,0,0,x`, "Line 2: axial_deg is not a number"],
    [`${HEAD}\nT7,0,0,0,0,0,`, "Line 2: axial_deg is not a number"],
    [`${HEAD}\nX7,0,0,0,0,0,0`, "Line 2 does not begin with a vertebra"],
    [`${HEAD}\nT7,0,0,0,0,0,0\nT7,0,0,0,0,0,0`, "Line 3 gives T7 a second time"],
    [`${HEAD}\n${"T7,0,0,0,0,0,0\n".repeat(31)}`, "more than 30"],
    ["{", "not valid JSON"],
    ["{}", "no list of poses"],
    ['[{"vertebra":"T7"}]', "Pose 1 lacks"],
    ['[{"vertebra":"T7","position_mm":[0,0,0]}]', "either rotation or angles_deg"],
  ])("%j is refused with its reason", (text, reason) => {
    const parsed = parsePoses(text);
    expect(parsed.items).toBeNull();
    expect(parsed.fault).toContain(reason);
  });
});

test("a target has angles, and positions where they are planned", () => {
  expect(parseTarget("vertebra,coronal_deg,sagittal_deg,axial_deg\nT9,0,12,0").items).toEqual([
    { vertebra: "T9", angles_deg: [0, 12, 0], position_mm: null },
  ]);
  const placed = parseTarget("vertebra,coronal_deg,sagittal_deg,axial_deg,x_mm,y_mm,z_mm\nT9,0,12,0,1,2,3");
  expect(placed.items?.[0]?.position_mm).toEqual([1, 2, 3]);
});
