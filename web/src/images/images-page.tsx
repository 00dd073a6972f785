/** The images of a stage: its takes, and the workspace of the one that is shown. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { Resource } from "../api/resource";
import type { Stage } from "../api/types";
import { href, paths } from "../app/route";
import { permits } from "../state/session";
import { pairsOf, type StageDocuments, useStage, useTake } from "./documents";
import { type Draft, EMPTY } from "./draft";
import "./images.css";
import { SaveProgress } from "./save-progress";
import { Workspace } from "./workspace";

interface ImagesPageProps {
  surgeryId: string;
  stage: string;
}

/** The page `#/surgeries/ID/stages/NAME/images`. */
export function ImagesPage({ surgeryId, stage }: ImagesPageProps): VNode {
  const documents = useStage(surgeryId, stage);
  return (
    <div class="images-page stack">
      <header class="page-heading">
        <h1 tabIndex={-1}>Images of {stage}</h1>
        <nav aria-label="Surgery" class="row muted">
          <a href={href(paths.surgery(surgeryId))}>{documents.state === "ready" ? documents.value.surgery.reference : "Surgery"}</a>
          <span aria-hidden="true">/</span>
          <a href={href(paths.stage(surgeryId, stage))}>{stage}</a>
        </nav>
      </header>
      <Resource of={documents} loading="Loading the takes">
        {(value) => <Takes key={`${surgeryId}/${stage}`} documents={value} />}
      </Resource>
    </div>
  );
}

/** Corrections that were not saved, by stage and take; they are there again when the page is. */
const drafts = new Map<string, Draft>();

interface Saving {
  job: string;
  take: number;
}

function Takes({ documents }: { documents: StageDocuments }): VNode {
  const { surgery, takes, counted } = documents;
  const [chosen, setChosen] = useState<number | null>(null);
  const [pair, setPair] = useState(1);
  const [compared, setCompared] = useState<number | null>(null);
  const [editing, setEditing] = useState(false);
  const [saving, setSaving] = useState<Saving | null>(null);
  const [said, setSaid] = useState<string | null>(null);
  const [, redraw] = useState(0);
  const shown = takes.find((take) => take.take === chosen && take.state === "succeeded") ?? counted;
  const ready = useTake(shown, pair);
  const earlier = useTake(takes.find((take) => take.take === compared) ?? null, pair);
  if (shown === null) return <NotMeasured latest={takes[0] ?? null} />;
  const key = `${surgery.id}/${shown.name}/${shown.take}/${pair}`;
  const draft = drafts.get(key) ?? EMPTY;
  const setDraft = (next: Draft, of = key): void => {
    if (next.count === 0 && next.edits.length === 0) drafts.delete(of);
    else drafts.set(of, next);
    redraw((count) => count + 1);
  };
  const leave = (): void => {
    setDraft(EMPTY);
    setEditing(false);
    setChosen(null);
  };
  const isBurst = pairsOf(shown) > 1;
  const notice = (
    <>
      {said !== null && (
        <p class="notice notice-good" role="status">
          {said}
        </p>
      )}
      {saving !== null && (
        <SaveProgress
          job={saving.job}
          take={saving.take}
          onDone={() => {
            setSaving(null);
            leave();
            setSaid(`Take ${saving.take} is shown. What a person placed or decided is marked with a diamond or a pencil.`);
          }}
          onClose={() => setSaving(null)}
        />
      )}
    </>
  );
  return (
    <>
      <div class="images-bar row">
        <label class="field">
          <span class="label">Take</span>
          <select
            aria-label="Take"
            value={shown.take}
            disabled={editing}
            onChange={(event) => {
              const take = Number(event.currentTarget.value);
              setChosen(take === counted?.take ? null : take);
              setCompared(null);
            }}
          >
            {takes.map((take) => (
              <option value={take.take} disabled={take.state !== "succeeded"}>
                {take.take}
                {take.take === counted?.take ? ", counts" : ""}
                {take.revision == null ? "" : `, revision of ${take.revision.of_take}`}
                {take.state === "succeeded" ? "" : `, ${take.state}`}
              </option>
            ))}
          </select>
        </label>
        {isBurst && (
          <label class="field">
            <span class="label">Pair of {pairsOf(shown)}</span>
            <input
              type="number"
              min={1}
              max={pairsOf(shown)}
              value={pair}
              disabled={editing}
              onChange={(event) => {
                const value = event.currentTarget.valueAsNumber;
                if (value >= 1 && value <= pairsOf(shown)) setPair(Math.round(value));
              }}
            />
          </label>
        )}
        {shown.take !== counted?.take && !editing && (
          <p class="notice notice-warning">
            This is take {shown.take}; the results of take {counted?.take} count.
          </p>
        )}
        {permits("correct:write") && !editing && shown.take === counted?.take && (
          <button
            type="button"
            class="button button-primary no-print"
            onClick={() => {
              setChosen(shown.take);
              setEditing(true);
              setSaid(null);
            }}
          >
            {draft.count > 0 ? "Go on correcting" : "Correct by hand"}
          </button>
        )}
        {!permits("correct:write") && <span class="muted small">Your key does not permit corrections (correct:write).</span>}
      </div>
      <Resource of={ready} loading="Loading the measurement">
        {(value) => (
          <Workspace
            key={key}
            surgery={surgery}
            documents={value}
            takes={takes}
            counted={counted}
            shown={shown}
            pair={pair}
            draft={draft}
            editing={editing}
            isSaving={saving !== null}
            compared={compared}
            earlier={earlier.state === "ready" ? earlier.value : null}
            notice={notice}
            onDraft={setDraft}
            onSaved={(job, take) => setSaving({ job, take })}
            onLeave={leave}
            onCarry={(next, take) => {
              setDraft(EMPTY);
              setDraft(next, `${surgery.id}/${shown.name}/${take}/${pair}`);
              setChosen(take);
            }}
            onShow={(take) => {
              setChosen(take === counted?.take ? null : take);
              setCompared(null);
            }}
            onCompare={setCompared}
          />
        )}
      </Resource>
    </>
  );
}

function NotMeasured({ latest }: { latest: Stage | null }): VNode {
  if (latest === null) return <p class="empty">This stage has no takes.</p>;
  if (latest.job.error !== null) {
    return (
      <div class="failure" role="alert">
        <strong>
          Take {latest.take} was not measured: {latest.job.error.title}
        </strong>
        <p>{latest.job.error.detail}</p>
      </div>
    );
  }
  return (
    <p class="empty" role="status">
      Take {latest.take} is {latest.state === "queued" ? "waiting for a worker" : latest.state}. Its images are shown here as
      soon as it is measured.
    </p>
  );
}
