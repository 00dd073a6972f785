/** What differs between two setups, in words: for a conflict, and for the list of revisions. */
import type { SpineSetup } from "../api/types";
import { DASH } from "../format/numbers";

export interface Difference {
  readonly field: string;
  readonly before: string;
  readonly after: string;
}

const FIELDS: readonly (readonly [string, (setup: SpineSetup) => string])[] = [
  ["Patient axes", axesText],
  ["Vertebrae with a marker", ({ levels }) => (levels == null ? "those of the surgery" : levels.join(", "))],
  ["Reference vertebra", ({ reference_vertebra }) => reference_vertebra ?? "that of the surgery"],
  ["Baseline stage", ({ baseline }) => baseline ?? "the first one"],
  ["Initial configuration", initialText],
  ["Target", ({ target }) => (target == null ? "none" : `${target.length} vertebrae: ${target.map(({ vertebra }) => vertebra).join(", ")}`)],
];

/** The fields in which two setups differ; all fields of the later one without an earlier one. */
export function differences(before: SpineSetup | null, after: SpineSetup): Difference[] {
  return FIELDS.map(([field, text]) => ({
    field,
    before: before === null ? DASH : text(before),
    after: text(after),
    same: before !== null && JSON.stringify(parts(before)[field]) === JSON.stringify(parts(after)[field]),
  }))
    .filter(({ same }) => !same)
    .map(({ field, before: from, after: to }) => ({ field, before: from, after: from === to ? `${to} (other numbers)` : to }));
}

/** The change that was made to one setup, carried over to another: fields that were not changed are theirs. */
export function rebased(base: SpineSetup | null, mine: SpineSetup, theirs: SpineSetup): SpineSetup {
  if (base === null) return mine;
  const pick = <K extends keyof SpineSetup>(key: K): SpineSetup[K] =>
    JSON.stringify(base[key] ?? null) === JSON.stringify(mine[key] ?? null) ? theirs[key] : mine[key];
  return {
    patient_axes: pick("patient_axes"),
    levels: pick("levels") ?? null,
    reference_vertebra: pick("reference_vertebra") ?? null,
    baseline: pick("baseline") ?? null,
    initial: pick("initial"),
    target: pick("target") ?? null,
  };
}

function parts(setup: SpineSetup): Record<string, unknown> {
  return {
    "Patient axes": setup.patient_axes,
    "Vertebrae with a marker": setup.levels ?? null,
    "Reference vertebra": setup.reference_vertebra ?? null,
    "Baseline stage": setup.baseline ?? null,
    "Initial configuration": setup.initial,
    Target: setup.target ?? null,
  };
}

function axesText({ patient_axes: axes }: SpineSetup): string {
  const sd = (value: number | undefined, unit: string): string => (value === undefined ? "" : ` (sd ${value} ${unit})`);
  if (axes.kind === "landmarks") return `three landmark points${sd(axes.landmark_sd_mm, "mm")}`;
  const text = (direction: string | number[]): string => (typeof direction === "string" ? direction : `(${direction.join(", ")})`);
  return `head ${text(axes.cephalad)}, left ${text(axes.left)}${sd(axes.direction_sd_deg, "deg")}`;
}

function initialText({ initial }: SpineSetup): string {
  switch (initial.kind) {
    case "generic":
      return `none: generic spine ${initial.cranial ?? "T1"} to ${initial.caudal ?? "L5"}, assumed`;
    case "poses":
      return `${initial.poses.length} poses, ${initial.frame} axes`;
    case "radiographs":
      return `radiographs: ${initial.vertebrae.length} vertebrae, ${initial.common.length} common points`;
  }
}
