import { describe, expect, test } from "vitest";

import type { SpineSetup } from "../../src/api/types";
import { anterior, formOf, newForm, setupOf } from "../../src/setup/form";

const SETUP: SpineSetup = {
  patient_axes: { kind: "directions", cephalad: "-x", left: [0, -1, 0.1] },
  levels: ["L1", "T9"],
  reference_vertebra: "T9",
  baseline: "PRE",
  initial: { kind: "generic", cranial: "T2", caudal: "L4" },
  target: [{ vertebra: "T9", angles_deg: [1, 2, 3], position_mm: null }],
};

test("a stored setup is the same after it was edited without a change", () => {
  expect(setupOf(formOf(SETUP))).toEqual({ setup: SETUP, faults: [] });
  const points: SpineSetup = {
    ...SETUP,
    patient_axes: { kind: "landmarks", caudal_mm: [0, 0, 0], cephalad_mm: [1.5, 0, 0], left_mm: [0, -2, 0] },
  };
  expect(setupOf(formOf(points)).setup).toEqual(points);
});

test("a deviation of the axes is kept, or is the usual one", () => {
  const directions: SpineSetup = { ...SETUP, patient_axes: { kind: "directions", cephalad: "-x", left: "-y", direction_sd_deg: 1.5 } };
  expect(setupOf(formOf(directions)).setup).toEqual(directions);
  const points: SpineSetup = {
    ...SETUP,
    patient_axes: { kind: "landmarks", caudal_mm: [0, 0, 0], cephalad_mm: [1.5, 0, 0], left_mm: [0, -2, 0], landmark_sd_mm: 4 },
  };
  expect(setupOf(formOf(points)).setup).toEqual(points);
  const faulty = { ...newForm("x"), axesSd: { directions: "-1", landmarks: "" } };
  expect(setupOf(faulty).faults.map(({ field }) => field)).toEqual(["axes-sd"]);
});

test("the first setup of a surgery can be stored as it is", () => {
  const { setup } = setupOf(newForm("y"));
  expect(setup?.patient_axes).toEqual({ kind: "directions", cephalad: "+y", left: "-x" });
  expect(setup?.initial.kind).toBe("generic");
});

test("the front follows by the right hand", () => {
  expect(anterior(newForm("x"))).toEqual([0, 0, -1]);
  expect(anterior({ ...newForm("x"), axes: "landmarks" })).toBeNull();
  const prone = anterior(formOf({ ...SETUP, patient_axes: { kind: "directions", cephalad: "-x", left: "+y" } }));
  expect(prone).toEqual([0, 0, 1]);
});

describe("what cannot be stored", () => {
  const faults = (change: Partial<ReturnType<typeof newForm>>): string[] =>
    setupOf({ ...newForm("x"), ...change }).faults.map(({ field }) => field);

  test("names its field", () => {
    expect(faults({ left: { choice: "-x", vector: ["", "", ""] } })).toEqual(["left"]);
    expect(faults({ left: { choice: "vector", vector: ["1", "b", "0"] } })).toEqual(["left"]);
    expect(faults({ cephalad: { choice: "vector", vector: ["0", "0", "0"] } })).toEqual(["cephalad"]);
    expect(faults({ initial: "poses" })).toEqual(["initial"]);
    expect(faults({ levels: [] })).toEqual(["levels"]);
    expect(faults({ axes: "landmarks" })).toEqual(["caudal_mm", "cephalad_mm", "left_mm"]);
  });

  test("does not include a decimal comma, or a landmark at the origin", () => {
    const point = ["0", "0", "0"] as const;
    const landmarks = { caudal_mm: point, cephalad_mm: ["1,5", "0", "0"], left_mm: ["0", "1", "0"] } as const;
    expect(faults({ axes: "landmarks", landmarks })).toEqual([]);
  });
});
