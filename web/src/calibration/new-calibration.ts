/** A calibration that is about to be made from shots of a control field. */
import type { Pair } from "../upload/pairing";

/** The service takes no more shots. */
export const MAX_SHOTS = 20;

export interface ShotsForm {
  readonly name: string;
  /** Name of a built-in control field or of a flat board; a file counts before it. */
  readonly controlField: string;
  readonly hasFieldFile: boolean;
  readonly pairs: readonly Pair[];
  /** Number of trailing shots held out for verification, as typed. */
  readonly verify: string;
  readonly pixelSize: string;
}

/** Why the form cannot be sent, as sentences; empty when it can. */
export function faults(form: ShotsForm): string[] {
  const found: string[] = [];
  if (form.name.trim() === "") found.push("Name the rig, such as cart 1.");
  if (form.controlField.trim() === "" && !form.hasFieldFile) found.push("Give the control field: pegboard-1995, a board, or a CSV file.");
  if (form.pairs.length === 0) found.push("Choose the left and right images of one shot or more.");
  if (form.pairs.length > MAX_SHOTS) found.push(`At most ${MAX_SHOTS} shots are used; choose fewer files.`);
  form.pairs.forEach((pair, row) => {
    if (pair.left === null || pair.right === null) {
      found.push(`Pair ${row + 1} has no ${pair.left === null ? "left" : "right"} image; choose it, or remove the pair.`);
    }
  });
  const verify = form.verify.trim() === "" ? 0 : Number(form.verify);
  if (!Number.isInteger(verify) || verify < 0) found.push("The number of shots held out is not a number.");
  else if (verify > 0 && verify >= form.pairs.length) found.push("Leave at least one shot to calibrate with.");
  if (form.pixelSize.trim() !== "" && !/^\s*\d*\.?\d+\s*,\s*\d*\.?\d+\s*$/.test(form.pixelSize)) {
    found.push("Give the width and the height of a pixel in mm, such as 0.01,0.00845.");
  }
  return found;
}

/** Return the parts of the form that the service takes. */
export function formOf(form: ShotsForm, files: readonly { readonly content: Blob }[], fieldFile: Blob | null, capturedAt: string | null): FormData {
  const data = new FormData();
  data.set("name", form.name.trim());
  if (fieldFile === null) data.set("control_field", form.controlField.trim());
  else data.set("control_field", fieldFile, "control-field.csv");
  for (const side of ["left", "right"] as const) {
    for (const pair of form.pairs) {
      const file = files[pair[side] ?? -1];
      // names of files are not sent: they may tell what they should not
      if (file !== undefined) data.append(side, file.content, side);
    }
  }
  data.set("verify", form.verify.trim() === "" ? "0" : form.verify.trim());
  if (form.pixelSize.trim() !== "") data.set("pixel_size", form.pixelSize.replaceAll(" ", ""));
  if (capturedAt !== null) data.set("captured_at", capturedAt);
  return data;
}
