import { describe, expect, test } from "vitest";

import { addressOf, CART, ceilingVariant, designsOf, disparityQueryOf, faultsOf, queryOf } from "../../src/planner/design";

describe("a design", () => {
  test("as the cart is has no fault and names every number", () => {
    expect(faultsOf(CART)).toEqual({});
    const query = new URLSearchParams(queryOf(CART));
    expect(query.get("baseline_mm")).toBe("422");
    expect(query.get("levels")).toBe("L1,T11,T9,T7");
    expect(query.has("calibration_id")).toBe(false);
    expect(query.has("disc_radius_mm")).toBe(false);
  });

  test("with a calibration has no numbers of a rig, with a disc no legs", () => {
    const query = new URLSearchParams(queryOf({ ...CART, calibration_id: "abc", disc_radius_mm: "20", baseline_mm: "x", xx_mm: "" }));
    expect(query.get("calibration_id")).toBe("abc");
    expect(query.has("baseline_mm")).toBe(false);
    expect(query.has("xx_mm")).toBe(false);
    expect(faultsOf({ ...CART, calibration_id: "abc", disc_radius_mm: "20", baseline_mm: "x", xx_mm: "" })).toEqual({});
  });

  test("may have decimal commas, and spaces between vertebrae", () => {
    const query = new URLSearchParams(queryOf({ ...CART, focal_length_mm: "7,7", levels: "l1; t9 t7" }));
    expect(query.get("focal_length_mm")).toBe("7.7");
    expect(query.get("levels")).toBe("L1,T9,T7");
  });

  test("asks for disparities with its rig and depth only", () => {
    const names = [...new URLSearchParams(disparityQueryOf(CART)).keys()];
    expect(names).toContain("depth_to_mm");
    expect(names).not.toContain("levels");
    expect(names).not.toContain("xx_mm");
  });

  test.each([
    ["baseline_mm", "49", "from 50 to 5000 mm"],
    ["baseline_mm", "", "give a number"],
    ["baseline_mm", "1e999", "give a number"],
    ["image_width_px", "568.5", "give a whole number"],
    ["levels", "<b>L1", "name vertebrae along the spine, such as L1, T11, T9"],
    ["depth_to_mm", "-60", "must lie above the other end"],
  ] as const)("with %s %j is not computed", (name, value, text) => {
    expect(faultsOf({ ...CART, [name]: value })).toEqual({ [name]: text });
  });
});

describe("the address", () => {
  const other = { ...CART, baseline_mm: "900", levels: "L1,T9 & T7" };

  test("has what differs from the cart, and gives the same designs again", () => {
    expect(addressOf(CART, null)).toBe("");
    expect(designsOf(`#/planner?${addressOf(other, null)}`)).toEqual({ first: other, second: null });
    expect(designsOf(`#/planner?${addressOf(CART, other)}`)).toEqual({ first: CART, second: other });
    expect(designsOf(`#/planner?${addressOf(other, CART)}`)).toEqual({ first: other, second: CART });
    expect(designsOf("#/planner")).toEqual({ first: CART, second: null });
  });
});

test("the variant at the ceiling keeps the field of view", () => {
  const rig = { baseline_mm: 422, height_mm: 736, focal_length_mm: 7.7, image_size_px: [568, 416], pixel_size_mm: [0.01, 0.00845] };
  const ceiling = ceilingVariant({ ...CART, calibration_id: "abc" }, rig, 2000, 1100);
  const slant = Math.hypot(550, 2000) / Math.hypot(211, 736);
  expect(Number(ceiling.focal_length_mm)).toBeCloseTo(7.7 * slant, 2);
  expect(ceiling).toMatchObject({ calibration_id: "", camera_height_mm: "2000", baseline_mm: "1100", image_width_px: "568" });
  expect(faultsOf(ceiling)).toEqual({});
});
