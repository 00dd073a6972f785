/** A stage that is about to be sent. */
import { type NamedFile, type Pair, pairFiles, stageNameOf } from "./pairing";

/** The service takes no longer bursts. */
export const MAX_PAIRS = 60;

const STAGE_NAME = /^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$/;

export interface Draft<F extends NamedFile = NamedFile> {
  readonly files: readonly F[];
  readonly pairs: readonly Pair[];
  /** Whether left and right are not known from the names. */
  readonly guessed: boolean;
  readonly name: string;
  readonly calibrationId: string;
  /** Local time of capture as a date field has it; empty when it is not known. */
  readonly capturedAt: string;
  /** Times of exposure by pair, as typed; all empty or none. */
  readonly exposures: readonly { readonly left: string; readonly right: string }[];
}

/** A draft of what was chosen; a name that was typed already is kept. */
export function draftOf<F extends NamedFile>(files: readonly F[], calibrationId: string, name: string): Draft<F> {
  const { pairs, guessed } = pairFiles(files);
  return {
    files,
    pairs,
    guessed,
    name: name === "" ? stageNameOf(files) : name,
    calibrationId,
    capturedAt: "",
    exposures: pairs.map(() => ({ left: "", right: "" })),
  };
}

/** Why a draft cannot be sent, as sentences; empty when it can. */
export function faults(draft: Draft): string[] {
  const found: string[] = [];
  if (draft.pairs.length === 0) found.push("Choose the two images of a pair, or those of a burst.");
  if (draft.pairs.length > MAX_PAIRS) found.push(`A burst has at most ${MAX_PAIRS} pairs; choose fewer files.`);
  draft.pairs.forEach((pair, row) => {
    if (pair.left === null || pair.right === null) {
      const side = pair.left === null ? "left" : "right";
      found.push(`Pair ${row + 1} has no ${side} image; choose it, or remove the pair.`);
    } else if (pair.left === pair.right) {
      found.push(`Pair ${row + 1} has the same image twice.`);
    }
  });
  if (!STAGE_NAME.test(draft.name)) {
    found.push("Name the stage: up to 64 letters, digits, dots, dashes and underscores, such as PRE.");
  }
  if (draft.calibrationId === "") found.push("Choose the calibration of the cameras.");
  if (draft.capturedAt !== "" && isoTime(draft.capturedAt) === null) found.push("The time of capture is not a time.");
  return [...found, ...faultsOfTimes(draft)];
}

/** A typed local or zoned time as RFC 3339 in UTC; null when it is none. */
export function isoTime(text: string): string | null {
  if (!/^\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}/.test(text.trim())) return null;
  const time = new Date(text.trim().replace(" ", "T"));
  return Number.isNaN(time.getTime()) ? null : time.toISOString();
}

/** The parts of the form in which a draft is sent. */
export function formOf(draft: Draft<NamedFile & { readonly content: Blob }>, retake: boolean): FormData {
  const form = new FormData();
  form.set("name", draft.name);
  form.set("calibration_id", draft.calibrationId);
  const captured = isoTime(draft.capturedAt);
  if (captured !== null) form.set("captured_at", captured);
  if (retake) form.set("retake", "true");
  for (const side of ["left", "right"] as const) {
    for (const pair of draft.pairs) {
      const file = draft.files[pair[side] ?? -1];
      // names of files may tell who is operated on: the service gets the side instead
      if (file !== undefined) form.append(side, file.content, side);
    }
  }
  draft.exposures.forEach((exposure) => {
    for (const side of ["left", "right"] as const) {
      const time = isoTime(exposure[side]);
      if (time !== null) form.append(`${side}_exposed_at`, time);
    }
  });
  return form;
}

function faultsOfTimes({ exposures }: Draft): string[] {
  const texts = exposures.flatMap(({ left, right }) => [left, right]);
  if (texts.every((text) => text === "")) return [];
  if (texts.some((text) => text === "")) return ["Give both times of exposure of every pair, or none."];
  return texts.some((text) => isoTime(text) === null) ? ["A time of exposure is not a time."] : [];
}
