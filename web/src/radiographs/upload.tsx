/** Upload of a radiograph: the file, its side and, unless a DICOM file has it, the pixel spacing. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { ProblemError, send } from "../api/client";
import { refresh } from "../api/resource";
import type { Radiograph } from "../api/types";
import { Failure } from "../app/failure";
import { VIEW_NAMES, type View } from "./landmarks";
import { spacingText } from "./spacing";

interface UploadProps {
  surgeryId: string;
  view: View;
  onDone: (radiograph: Radiograph) => void;
}

/** The form of one view. */
export function UploadForm({ surgeryId, view, onDone }: UploadProps): VNode {
  const [file, setFile] = useState<File | null>(null);
  const [side, setSide] = useState<"left" | "right">(view === "pa" ? "left" : "right");
  const [rows, setRows] = useState("");
  const [columns, setColumns] = useState("");
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const [busy, setBusy] = useState(false);
  const spacing = spacingText(rows, columns);
  const id = (name: string): string => `upload-${view}-${name}`;

  const upload = async (): Promise<void> => {
    if (file === null || spacing.state === "wrong") return;
    const form = new FormData();
    form.set("view", view);
    form.set(view === "pa" ? "left_on" : "anterior_on", side);
    if (spacing.state === "given") form.set("pixel_spacing_mm", spacing.text);
    form.set("image", file, "radiograph");
    setBusy(true);
    setProblem(null);
    try {
      const path = `/v1/surgeries/${encodeURIComponent(surgeryId)}/radiographs`;
      const radiograph = await send<Radiograph>("POST", path, form);
      refresh(path);
      setFile(null);
      onDone(radiograph);
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      setProblem(error);
    } finally {
      setBusy(false);
    }
  };

  return (
    <form
      class="panel stack"
      aria-labelledby={id("title")}
      onSubmit={(event) => {
        event.preventDefault();
        void upload();
      }}
    >
      <h2 id={id("title")}>{view === "pa" ? "PA radiograph" : "Lateral radiograph"}</h2>
      <div class="upload-grid">
        <div class="field wide">
          <label for={id("file")}>File with the head at its top</label>
          <input
            id={id("file")}
            type="file"
            accept=".dcm,.png,.jpg,.jpeg,.tif,.tiff,application/dicom,image/png,image/jpeg,image/tiff"
            onChange={(event) => setFile(event.currentTarget.files?.[0] ?? null)}
          />
          <span class="hint">DICOM, PNG, JPEG or TIFF. Only gray levels and spacing are kept, no names.</span>
        </div>
        <div class="field wide">
          <label for={id("side")}>{view === "pa" ? "The patient’s left is on the" : "The patient’s front is on the"}</label>
          <select id={id("side")} value={side} onChange={(event) => setSide(event.currentTarget.value as "left" | "right")}>
            <option value="left">left of the image</option>
            <option value="right">right of the image</option>
          </select>
        </div>
        <div class="field">
          <label for={id("rows")}>Distance of rows, mm</label>
          <input id={id("rows")} inputMode="decimal" value={rows} onInput={(event) => setRows(event.currentTarget.value)} aria-invalid={spacing.state === "wrong"} />
        </div>
        <div class="field">
          <label for={id("columns")}>Distance of columns, mm</label>
          <input id={id("columns")} inputMode="decimal" value={columns} onInput={(event) => setColumns(event.currentTarget.value)} aria-invalid={spacing.state === "wrong"} />
        </div>
        <p class="wide small muted" role={spacing.state === "wrong" ? "alert" : undefined}>
          {spacing.state === "wrong" ? spacing.reason : "At the patient, not at the detector. May be left out for DICOM files that have it."}
        </p>
      </div>
      {problem !== null && <Failure problem={problem} />}
      <div class="row">
        <button type="submit" class="button button-primary" disabled={busy || file === null || spacing.state === "wrong"}>
          {busy ? "Uploading …" : `Upload the ${VIEW_NAMES[view]} view`}
        </button>
      </div>
    </form>
  );
}
