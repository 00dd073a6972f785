/** Sending a stereo pair or a burst: choose or drop files, look at the assignment, send. */
import type { VNode } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

import { useResource } from "../api/resource";
import type { CalibrationPage } from "../api/types";
import { href, paths } from "../app/route";
import { age, duration } from "../format/time";
import { now } from "../state/now";
import type { StageGroup } from "../timeline/stages";
import { type Draft, draftOf, faults } from "./draft";
import { type ChosenFile, chosen, dropped } from "./files";
import { PairTable } from "./pair-table";
import { foldersOf } from "./pairing";
import { Times } from "./times";
import { Transfers } from "./transfers";
import "./upload.css";
import { sendStage } from "./uploads";

const CHOOSER = "stage-files";
const CALIBRATIONS = "/v1/calibrations?limit=100";

interface UploadPanelProps {
  surgeryId: string;
  groups: readonly StageGroup[];
  /** Name of a stage that is to be taken again. */
  retakeOf: string | null;
}

/** Show the form, and move the focus to its file chooser. */
export function focusUpload(): void {
  const chooser = document.getElementById(CHOOSER);
  chooser?.scrollIntoView({ block: "center" });
  chooser?.focus();
}

/** The form of a stage. */
export function UploadPanel({ surgeryId, groups, retakeOf }: UploadPanelProps): VNode {
  const calibrations = useResource<CalibrationPage>(CALIBRATIONS);
  const known = calibrations.state === "ready" ? calibrations.value.items : [];
  const usual = groups.at(-1)?.latest.calibration_id ?? known[0]?.id ?? "";
  const [draft, setDraft] = useState<Draft<ChosenFile>>(() => draftOf<ChosenFile>([], "", ""));
  const [asked, setAsked] = useState(false);
  const [remark, setRemark] = useState("");
  const panel = useRef<HTMLElement>(null);
  const chooser = useRef<HTMLInputElement>(null);

  const complete = { ...draft, calibrationId: draft.calibrationId || usual };
  const found = faults(complete);
  const retake = groups.some(({ name, counted }) => name === draft.name && counted.state === "succeeded");
  const change = (values: Partial<Draft<ChosenFile>>): void => setDraft({ ...draft, ...values });

  const take = (files: readonly ChosenFile[]): void => {
    const folders = foldersOf(files);
    if (folders.length > 1) {
      setRemark(`These files are of ${folders.length} folders (${folders.slice(0, 5).join(", ")}); send one stage at a time.`);
      return;
    }
    setRemark(files.length === 0 ? "There are no files in what was dropped." : "");
    setAsked(false);
    setDraft(draftOf(files, draft.calibrationId, retakeOf ?? ""));
  };
  const dragging = useDrop(take, panel);

  useEffect(() => {
    if (retakeOf === null) return;
    setDraft((before) => ({ ...before, name: retakeOf }));
    focusUpload();
  }, [retakeOf]);

  const send = (): void => {
    setAsked(true);
    if (found.length > 0) return;
    void sendStage(surgeryId, complete, retake);
    setDraft(draftOf<ChosenFile>([], complete.calibrationId, ""));
    setAsked(false);
    if (chooser.current !== null) chooser.current.value = "";
    chooser.current?.focus();
  };

  return (
    <section ref={panel} class={`panel stack upload no-print${dragging ? " upload-over" : ""}`} aria-labelledby="upload-heading">
      <header>
        <h2 id="upload-heading">Add a stage</h2>
      </header>
      <Chooser chooser={chooser} onFiles={take} />
      {remark !== "" && (
        <p class="notice notice-warning" role="alert">
          {remark}
        </p>
      )}
      {draft.pairs.length > 0 && <PairTable draft={draft} onChange={change} />}
      <div class="upload-fields">
        <div class="field">
          <label for="stage-name">Name of the stage</label>
          <input
            id="stage-name"
            autocomplete="off"
            maxLength={64}
            placeholder="PRE"
            value={draft.name}
            aria-describedby="stage-name-hint"
            onInput={(event) => change({ name: event.currentTarget.value })}
          />
          <p class="hint" id="stage-name-hint">
            {retake ? `${draft.name} is there already: this is its next take.` : "Letters, digits, dots, dashes and underscores."}
          </p>
        </div>
        <div class="field">
          <label for="calibration">Calibration</label>
          <select id="calibration" value={complete.calibrationId} onChange={(event) => change({ calibrationId: event.currentTarget.value })}>
            {known.map(({ id, name, calibrated_at, created_at }) => (
              <option value={id} selected={id === complete.calibrationId}>
                {name} · {ageText(calibrated_at ?? created_at)}
              </option>
            ))}
          </select>
          {calibrations.state === "ready" && known.length === 0 && (
            <p class="wrong">
              There is no calibration. <a href={href(paths.calibrations)}>Add one</a> first.
            </p>
          )}
        </div>
      </div>
      <Times draft={draft} onChange={change} />
      {asked && found.length > 0 && (
        <div class="failure" role="alert">
          <strong>Not sent yet</strong>
          <ul>
            {found.map((fault) => (
              <li>{fault}</li>
            ))}
          </ul>
        </div>
      )}
      <p class="row">
        <button type="button" class="button button-primary" onClick={send}>
          {draft.pairs.length > 1 ? `Send a burst of ${draft.pairs.length} pairs` : retake ? "Send another take" : "Send the pair"}
        </button>
        {draft.pairs.length > 0 && (
          <button type="button" class="button" onClick={() => setDraft(draftOf<ChosenFile>([], draft.calibrationId, ""))}>
            Clear
          </button>
        )}
      </p>
      <Transfers surgeryId={surgeryId} groups={groups} />
    </section>
  );
}

interface ChooserProps {
  chooser: { current: HTMLInputElement | null };
  onFiles: (files: readonly ChosenFile[]) => void;
}

function Chooser({ chooser, onFiles }: ChooserProps): VNode {
  return (
    <div class="upload-drop">
      <label class="label" for={CHOOSER}>
        Images: a stereo pair, or a burst of up to 60 pairs
      </label>
      <input
        id={CHOOSER}
        ref={chooser}
        type="file"
        multiple
        accept=".png,.tif,.tiff,.jpg,.jpeg,.ras,.im1,.im8,.im24,image/png,image/tiff,image/jpeg"
        aria-describedby="stage-files-hint"
        onChange={(event) => onFiles(chosen(event.currentTarget.files ?? new DataTransfer().files))}
      />
      <p class="small muted" id="stage-files-hint">
        Or drop files or a folder anywhere on this page. PNG, TIFF, JPEG or Sun raster. Names of files are not sent.
      </p>
    </div>
  );
}

/** Take what is dropped anywhere on the page; returns whether something is being dragged over it. */
function useDrop(take: (files: readonly ChosenFile[]) => void, panel: { readonly current: HTMLElement | null }): boolean {
  const [over, setOver] = useState(false);
  const latest = useRef(take);
  latest.current = take;
  useEffect(() => {
    const isFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes("Files") ?? false;
    const drag = (event: DragEvent): void => {
      if (!isFiles(event)) return;
      event.preventDefault();
      setOver(true);
    };
    const leave = (event: DragEvent): void => {
      if (event.relatedTarget === null) setOver(false);
    };
    const drop = (event: DragEvent): void => {
      if (!isFiles(event) || event.dataTransfer === null) return;
      event.preventDefault();
      setOver(false);
      panel.current?.scrollIntoView({ block: "center" });
      void dropped(event.dataTransfer).then((files) => latest.current(files));
    };
    addEventListener("dragover", drag);
    addEventListener("dragleave", leave);
    addEventListener("drop", drop);
    return () => {
      removeEventListener("dragover", drag);
      removeEventListener("dragleave", leave);
      removeEventListener("drop", drop);
    };
  }, []);
  return over;
}

function ageText(timestamp: string): string {
  const seconds = age(timestamp, now.value);
  return seconds === null ? "age not known" : `${duration(seconds)} old`;
}
