import { describe, expect, test } from "vitest";

import type { SpineSetup } from "../../src/api/types";
import { differences, rebased } from "../../src/setup/differences";

const BASE: SpineSetup = {
  patient_axes: { kind: "directions", cephalad: "+x", left: "+y" },
  levels: null,
  reference_vertebra: null,
  baseline: null,
  initial: { kind: "generic", cranial: "T1", caudal: "L5" },
  target: null,
};
const MINE: SpineSetup = { ...BASE, patient_axes: { kind: "directions", cephalad: "+x", left: "-y" } };
const THEIRS: SpineSetup = { ...BASE, initial: { kind: "generic", cranial: "T4", caudal: "L2" } };

describe("differences", () => {
  test("are in words, and only what differs", () => {
    expect(differences(BASE, BASE)).toEqual([]);
    expect(differences(BASE, MINE)).toEqual([{ field: "Patient axes", before: "head +x, left +y", after: "head +x, left -y" }]);
    expect(differences(null, BASE)).toHaveLength(6);
    const surer: SpineSetup = { ...BASE, patient_axes: { kind: "directions", cephalad: "+x", left: "+y", direction_sd_deg: 1 } };
    expect(differences(BASE, surer)[0]?.after).toBe("head +x, left +y (sd 1 deg)");
  });

  test("are told of numbers that the words do not show", () => {
    const poses = (x: number): SpineSetup => ({
      ...BASE,
      initial: { kind: "poses", frame: "patient", poses: [{ vertebra: "T9", position_mm: [x, 0, 0], angles_deg: [0, 0, 0] }] } as unknown as SpineSetup["initial"],
    });
    expect(differences(poses(1), poses(2))[0]?.after).toBe("1 poses, patient axes (other numbers)");
  });
});

describe("a change carried over", () => {
  test("keeps what only they changed and what only I changed", () => {
    expect(rebased(BASE, MINE, THEIRS)).toEqual({ ...MINE, initial: THEIRS.initial });
  });

  test("is mine where both changed the same", () => {
    const other: SpineSetup = { ...BASE, patient_axes: { kind: "directions", cephalad: "-x", left: "+y" } };
    expect(rebased(BASE, MINE, other).patient_axes).toEqual(MINE.patient_axes);
  });

  test("is all of mine when there was nothing before", () => {
    expect(rebased(null, MINE, THEIRS)).toEqual(MINE);
  });
});
