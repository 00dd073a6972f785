/** The setup of a spine while it is edited: texts as they are typed, and what is wrong with them. */
import type { InitialPoses, InitialRadiographs, SpineSetup, TargetVertebra } from "../api/types";

export type Axis = "+x" | "-x" | "+y" | "-y" | "+z" | "-z";
export const AXES: readonly Axis[] = ["+x", "-x", "+y", "-y", "+z", "-z"];

/** A direction: a signed axis, or `vector` with three typed numbers. */
export interface DirectionForm {
  readonly choice: Axis | "vector";
  readonly vector: readonly [string, string, string];
}

export type LandmarkName = "caudal_mm" | "cephalad_mm" | "left_mm";
export type InitialChoice = "generic" | "poses" | "radiographs";

export interface SetupForm {
  readonly axes: "directions" | "landmarks";
  readonly cephalad: DirectionForm;
  readonly left: DirectionForm;
  readonly landmarks: Readonly<Record<LandmarkName, readonly [string, string, string]>>;
  /** Standard deviation of each direction, degrees, and of each point, mm; empty for the usual one. */
  readonly axesSd: Readonly<Record<"directions" | "landmarks", string>>;
  /** Vertebrae with a marker; null for those of the surgery. */
  readonly levels: readonly string[] | null;
  readonly reference: string | null;
  readonly baseline: string | null;
  readonly initial: InitialChoice;
  readonly generic: { readonly cranial: string; readonly caudal: string };
  readonly poses: InitialPoses | null;
  readonly radiographs: InitialRadiographs | null;
  readonly target: readonly TargetVertebra[] | null;
}

/** Something that keeps a setup from being stored, and the field that it concerns. */
export interface Fault {
  readonly field: string;
  readonly text: string;
}

const NO_POINT = ["", "", ""] as const;

/** The form of a surgery without a setup. */
export function newForm(spineAxis: "x" | "y" | "auto"): SetupForm {
  const along = spineAxis === "y" ? "+y" : "+x";
  return {
    axes: "directions",
    cephalad: { choice: along, vector: NO_POINT },
    left: { choice: along === "+x" ? "+y" : "-x", vector: NO_POINT },
    landmarks: { caudal_mm: NO_POINT, cephalad_mm: NO_POINT, left_mm: NO_POINT },
    axesSd: { directions: "", landmarks: "" },
    levels: null,
    reference: null,
    baseline: null,
    initial: "generic",
    generic: { cranial: "T1", caudal: "L5" },
    poses: null,
    radiographs: null,
    target: null,
  };
}

/** The form of a stored setup. */
export function formOf(setup: SpineSetup): SetupForm {
  const blank = newForm("auto");
  const axes = setup.patient_axes;
  const { initial } = setup;
  return {
    ...blank,
    axes: axes.kind,
    cephalad: axes.kind === "directions" ? directionOf(axes.cephalad) : blank.cephalad,
    left: axes.kind === "directions" ? directionOf(axes.left) : blank.left,
    landmarks:
      axes.kind === "landmarks"
        ? { caudal_mm: texts(axes.caudal_mm), cephalad_mm: texts(axes.cephalad_mm), left_mm: texts(axes.left_mm) }
        : blank.landmarks,
    axesSd: {
      directions: axes.kind === "directions" ? sdText(axes.direction_sd_deg) : "",
      landmarks: axes.kind === "landmarks" ? sdText(axes.landmark_sd_mm) : "",
    },
    levels: setup.levels ?? null,
    reference: setup.reference_vertebra ?? null,
    baseline: setup.baseline ?? null,
    initial: initial.kind,
    generic:
      initial.kind === "generic" ? { cranial: initial.cranial ?? "T1", caudal: initial.caudal ?? "L5" } : blank.generic,
    poses: initial.kind === "poses" ? initial : null,
    radiographs: initial.kind === "radiographs" ? initial : null,
    target: setup.target ?? null,
  };
}

/** The setup of a form, or the faults that prevent it. */
export function setupOf(form: SetupForm): { setup: SpineSetup; faults: readonly [] } | { setup: null; faults: readonly Fault[] } {
  const faults: Fault[] = [];
  const axes = axesOf(form, faults);
  const initial = initialOf(form, faults);
  if (form.levels !== null && form.levels.length === 0) {
    faults.push({ field: "levels", text: "choose at least one vertebra with a marker" });
  }
  if (axes === null || initial === null || faults.length > 0) return { setup: null, faults };
  const setup: SpineSetup = {
    patient_axes: axes,
    levels: form.levels === null ? null : [...form.levels],
    reference_vertebra: form.reference,
    baseline: form.baseline,
    initial,
    target: form.target === null ? null : [...form.target],
  };
  return { setup, faults: [] };
}

function axesOf(form: SetupForm, faults: Fault[]): SpineSetup["patient_axes"] | null {
  if (form.axes === "landmarks") {
    const [caudal, cephalad, left] = (["caudal_mm", "cephalad_mm", "left_mm"] as const).map((name) =>
      numbersOf(form.landmarks[name], name, "give three coordinates in mm", faults),
    );
    const sd = sdOf(form.axesSd.landmarks, 100, "mm", faults);
    if (!caudal || !cephalad || !left) return null;
    return { kind: "landmarks", caudal_mm: caudal, cephalad_mm: cephalad, left_mm: left, ...(sd !== null && { landmark_sd_mm: sd }) };
  }
  const [cephalad, left] = (["cephalad", "left"] as const).map((name) => {
    const { choice, vector } = form[name];
    return choice === "vector" ? numbersOf(vector, name, "give three numbers, not all 0", faults) : choice;
  });
  const sd = sdOf(form.axesSd.directions, 45, "degrees", faults);
  if (!cephalad || !left) return null;
  if (angleDeg(vectorOf(cephalad), vectorOf(left)) < 1) {
    faults.push({ field: "left", text: "the direction to the left lies along that to the head; choose another" });
    return null;
  }
  return { kind: "directions", cephalad, left, ...(sd !== null && { direction_sd_deg: sd }) };
}

/** A typed standard deviation; null for the usual one. */
function sdOf(typed: string, most: number, unit: string, faults: Fault[]): number | null {
  if (typed.trim() === "") return null;
  const sd = Number(typed.replace(",", "."));
  if (sd > 0 && sd <= most) return sd;
  faults.push({ field: "axes-sd", text: `give a deviation above 0 and up to ${most} ${unit}, or leave it empty` });
  return null;
}

function sdText(sd: number | undefined): string {
  return sd === undefined ? "" : String(sd);
}

function initialOf(form: SetupForm, faults: Fault[]): SpineSetup["initial"] | null {
  if (form.initial === "generic") return { kind: "generic", ...form.generic };
  const chosen = form.initial === "poses" ? form.poses : form.radiographs;
  if (chosen !== null) return chosen;
  const text =
    form.initial === "poses"
      ? "choose a file with the poses of the vertebrae"
      : "digitize the radiographs until there is a fit";
  faults.push({ field: "initial", text });
  return null;
}

function numbersOf(typed: readonly string[], field: string, text: string, faults: Fault[]): number[] | null {
  const numbers = typed.map((each) => (each.trim() === "" ? Number.NaN : Number(each.replace(",", "."))));
  const isDirection = !field.endsWith("_mm");
  if (numbers.every(Number.isFinite) && !(isDirection && numbers.every((number) => number === 0))) return numbers;
  faults.push({ field, text });
  return null;
}

/** Angle between two lines, degrees. */
function angleDeg(a: readonly number[], b: readonly number[]): number {
  const dot = a.reduce((sum, value, axis) => sum + value * (b[axis] ?? 0), 0);
  const cosine = Math.abs(dot) / (Math.hypot(...a) * Math.hypot(...b));
  return (Math.acos(Math.min(1, cosine)) * 180) / Math.PI;
}

/** A direction as a vector in object space. */
export function vectorOf(direction: string | readonly number[]): number[] {
  if (typeof direction !== "string") return [...direction];
  const sign = direction.startsWith("-") ? -1 : 1;
  return ["x", "y", "z"].map((axis) => (direction.endsWith(axis) ? sign : 0));
}

/** The patient's anterior direction: left times cephalad, in object space; null while either is not known. */
export function anterior(form: SetupForm): number[] | null {
  const axes = axesOf(form, []);
  if (axes === null) return null;
  const [z, y] =
    axes.kind === "directions"
      ? [vectorOf(axes.cephalad), vectorOf(axes.left)]
      : [minus(axes.cephalad_mm, axes.caudal_mm), minus(axes.left_mm, axes.caudal_mm)];
  const cross = [0, 1, 2].map((i) => {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    return (y[j] ?? 0) * (z[k] ?? 0) - (y[k] ?? 0) * (z[j] ?? 0);
  });
  const length = Math.hypot(...cross);
  return length < 1e-9 ? null : cross.map((value) => value / length + 0);
}

function minus(a: readonly number[], b: readonly number[]): number[] {
  return a.map((value, axis) => value - (b[axis] ?? 0));
}

function directionOf(direction: string | number[]): DirectionForm {
  if (typeof direction === "string") return { choice: direction as Axis, vector: NO_POINT };
  return { choice: "vector", vector: texts(direction) };
}

function texts(numbers: readonly number[]): readonly [string, string, string] {
  return [String(numbers[0] ?? ""), String(numbers[1] ?? ""), String(numbers[2] ?? "")];
}
