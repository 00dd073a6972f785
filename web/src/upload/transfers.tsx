/** Stages on their way: bytes while they are sent, the steps of the job while they are measured. */
import type { VNode } from "preact";

import { Failure } from "../app/failure";
import { href, paths } from "../app/route";
import { withUnit } from "../format/numbers";
import { progressText, type StageGroup } from "../timeline/stages";
import { discard, sendAgain, type Upload, uploads } from "./uploads";

/** The stages that were sent from this page. */
export function Transfers({ surgeryId, groups }: { surgeryId: string; groups: readonly StageGroup[] }): VNode | null {
  const own = uploads.value.filter((upload) => upload.surgeryId === surgeryId);
  if (own.length === 0) return null;
  return (
    <ul class="transfers" aria-label="Stages on their way">
      {own.map((upload) => (
        <li key={upload.id}>
          <TransferState upload={upload} group={groups.find(({ name }) => name === upload.name) ?? null} />
        </li>
      ))}
    </ul>
  );
}

function TransferState({ upload, group }: { upload: Upload; group: StageGroup | null }): VNode {
  if (upload.state === "failed" && upload.problem !== null) {
    return (
      <div class="stack">
        <strong>{upload.name} was not stored</strong>
        <Failure problem={upload.problem} />
        <p class="row">
          <button type="button" class="button button-small" onClick={() => void sendAgain(upload)}>
            Send again
          </button>
          <button type="button" class="button button-small" onClick={() => discard(upload.id)}>
            Discard
          </button>
        </p>
      </div>
    );
  }
  if (upload.state === "sending") {
    return (
      <div class="transfer">
        <strong>{upload.name}</strong>
        <progress value={upload.sent} aria-label={`Bytes of ${upload.name} sent`} />
        <span class="small">
          {megabytes(upload.sent * upload.bytes)} of {withUnit(megabytes(upload.bytes), "MB")} sent
        </span>
        <button type="button" class="button button-small" onClick={() => discard(upload.id)}>
          Give up
        </button>
      </div>
    );
  }
  const measuring = group?.active ?? false;
  return (
    <div class="transfer" role="status">
      <strong>{upload.name}</strong>
      {measuring && group !== null ? (
        <>
          <progress value={group.latest.job.progress} aria-label={`Progress of ${upload.name}`} />
          <span class="small">stored; {progressText(group.latest)}</span>
        </>
      ) : (
        <a href={href(paths.stage(upload.surgeryId, upload.name))}>{group?.latest.state === "succeeded" ? "measured" : "stored"}</a>
      )}
      <button type="button" class="button button-small" aria-label={`Forget ${upload.name}`} onClick={() => discard(upload.id)}>
        Close
      </button>
    </div>
  );
}

function megabytes(bytes: number): string {
  return (bytes / 1e6).toFixed(1);
}
