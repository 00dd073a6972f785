/** New calibrations: a rig that was calibrated elsewhere, or shots of a control field. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { randomId, ProblemError, send } from "../api/client";
import { refresh } from "../api/resource";
import type { CalibrationDetail, Job } from "../api/types";
import { Failure } from "../app/failure";
import { href, navigate, paths } from "../app/route";
import { isoTime, type Draft, draftOf } from "../upload/draft";
import { chosen, type ChosenFile } from "../upload/files";
import { PairTable } from "../upload/pair-table";
import { transfer } from "../upload/transfer";
import "../upload/upload.css";
import { JobProgress } from "./job-progress";
import { faults, formOf } from "./new-calibration";

/** Both forms. */
export function NewCalibration(): VNode {
  return (
    <div class="calibration-pair no-print">
      <ShotsForm />
      <RigForm />
    </div>
  );
}

function RigForm(): VNode {
  const [file, setFile] = useState<File | null>(null);
  const [calibratedAt, setCalibratedAt] = useState("");
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const [busy, setBusy] = useState(false);
  async function submit(): Promise<void> {
    if (file === null) return;
    setBusy(true);
    setProblem(null);
    const time = isoTime(calibratedAt);
    const query = time === null ? "" : `?${new URLSearchParams({ calibrated_at: time })}`;
    try {
      // the text as it is: a decoded rig would lose a field that is given twice, which the service refuses
      const made = await send<CalibrationDetail>("POST", `/v1/calibrations${query}`, await file.text(), { "Content-Type": "application/json" });
      refresh("/v1/calibrations");
      navigate(paths.calibration(made.id));
    } catch (error) {
      setProblem(asProblem(error));
      setBusy(false);
    }
  }
  return (
    <section class="panel stack" aria-labelledby="rig-title">
      <header>
        <h2 id="rig-title">Store a rig calibrated elsewhere</h2>
      </header>
      <form
        class="stack"
        onSubmit={(event) => {
          event.preventDefault();
          void submit();
        }}
      >
        <div class="field">
          <label for="rig-file">Rig file</label>
          <input id="rig-file" type="file" accept=".json,application/json" onChange={(event) => setFile(event.currentTarget.files?.[0] ?? null)} />
          <span class="hint">JSON with the left and the right camera; spinewatch convert makes it from other formats.</span>
        </div>
        <div class="field">
          <label for="rig-time">Calibrated at</label>
          <input id="rig-time" type="datetime-local" value={calibratedAt} onInput={(event) => setCalibratedAt(event.currentTarget.value)} />
          <span class="hint">Its age counts from then; without it from now.</span>
        </div>
        {problem !== null && <Failure problem={problem} />}
        <div>
          <button type="submit" class="button button-primary" disabled={file === null || busy}>
            {busy ? "Storing …" : "Store the rig"}
          </button>
        </div>
      </form>
    </section>
  );
}

interface Sending {
  readonly sent: number;
  readonly total: number;
}

function ShotsForm(): VNode {
  const [draft, setDraft] = useState<Draft<ChosenFile>>(() => draftOf<ChosenFile>([], "", ""));
  const [name, setName] = useState("");
  const [controlField, setControlField] = useState("pegboard-1995");
  const [fieldFile, setFieldFile] = useState<File | null>(null);
  const [verify, setVerify] = useState("1");
  const [pixelSize, setPixelSize] = useState("");
  const [capturedAt, setCapturedAt] = useState("");
  const [asked, setAsked] = useState(false);
  const [sending, setSending] = useState<Sending | null>(null);
  const [problem, setProblem] = useState<ProblemError | null>(null);
  const [job, setJob] = useState<string | null>(null);
  // the same key for the same form: an attempt after a lost answer stores it once
  const [key, setKey] = useState(randomId);
  const form = { name, controlField, hasFieldFile: fieldFile !== null, pairs: draft.pairs, verify, pixelSize };
  const found = faults(form);

  async function submit(): Promise<void> {
    setAsked(true);
    if (found.length > 0) return;
    setProblem(null);
    setSending({ sent: 0, total: 0 });
    const data = formOf(form, draft.files, fieldFile, isoTime(capturedAt));
    try {
      const { id } = await transfer<Job>("/v1/calibrations/from-images", data, key, (sent, total) => setSending({ sent, total })).answer;
      setJob(id);
      setKey(randomId());
      setAsked(false);
    } catch (error) {
      setProblem(asProblem(error));
      if (asProblem(error).status !== 0) setKey(randomId());
    } finally {
      setSending(null);
    }
  }
  return (
    <section class="panel stack" aria-labelledby="shots-form-title">
      <header>
        <h2 id="shots-form-title">Calibrate from shots of a control field</h2>
      </header>
      <form
        class="stack"
        onSubmit={(event) => {
          event.preventDefault();
          void submit();
        }}
      >
        <div class="calibration-fields">
          <div class="field">
            <label for="shots-name">Name of the rig</label>
            <input id="shots-name" value={name} maxLength={200} onInput={(event) => setName(event.currentTarget.value)} />
          </div>
          <div class="field">
            <label for="shots-field">Control field</label>
            <input id="shots-field" value={controlField} list="control-fields" disabled={fieldFile !== null} onInput={(event) => setControlField(event.currentTarget.value)} />
            <datalist id="control-fields">
              <option value="pegboard-1995" />
              <option value="chessboard:9x6:25" />
              <option value="charuco:7x5:40:30:DICT_5X5_100" />
            </datalist>
          </div>
          <div class="field">
            <label for="shots-field-file">or its coordinates (CSV)</label>
            <input id="shots-field-file" type="file" accept=".csv,text/csv" onChange={(event) => setFieldFile(event.currentTarget.files?.[0] ?? null)} />
          </div>
          <div class="field">
            <label for="shots-verify">Shots held out for verification</label>
            <input id="shots-verify" inputMode="numeric" value={verify} onInput={(event) => setVerify(event.currentTarget.value)} />
          </div>
          <div class="field">
            <label for="shots-pixel">Pixel width, height in mm</label>
            <input id="shots-pixel" value={pixelSize} placeholder="those of the cart" onInput={(event) => setPixelSize(event.currentTarget.value)} />
          </div>
          <div class="field">
            <label for="shots-time">Captured at</label>
            <input id="shots-time" type="datetime-local" value={capturedAt} onInput={(event) => setCapturedAt(event.currentTarget.value)} />
          </div>
        </div>
        <div class="field">
          <label for="shots-files">Images, left and right of each shot</label>
          <input
            id="shots-files"
            type="file"
            multiple
            accept="image/*,.tif,.tiff,.ras"
            onChange={(event) => setDraft(draftOf(chosen(event.currentTarget.files ?? new DataTransfer().files), "", ""))}
          />
          <span class="hint">The first shot defines object space; the last ones are those held out.</span>
        </div>
        {draft.files.length > 0 && <PairTable draft={draft} onChange={(values) => setDraft({ ...draft, ...values })} />}
        {asked && found.length > 0 && (
          <ul class="notice notice-error" role="alert">
            {found.map((fault) => (
              <li>{fault}</li>
            ))}
          </ul>
        )}
        {problem !== null && <Failure problem={problem} />}
        <div class="row">
          <button type="submit" class="button button-primary" disabled={sending !== null}>
            Calibrate
          </button>
          {sending !== null && (
            <>
              <progress value={sending.sent} max={Math.max(1, sending.total)} aria-label="Bytes sent" />
              <span class="small">{megabytes(sending.sent)} of {megabytes(sending.total)} MB sent</span>
            </>
          )}
        </div>
      </form>
      {job !== null && <JobProgress id={job} />}
      <p class="muted small">
        A calibration never changes: another one is a new rig in the list. <a href={href(paths.planner)}>Plan a rig</a>
      </p>
    </section>
  );
}

function asProblem(error: unknown): ProblemError {
  return error instanceof ProblemError ? error : new ProblemError(0, "unknown", "Not sent", String(error));
}

function megabytes(bytes: number): string {
  return (bytes / 1e6).toFixed(1);
}
