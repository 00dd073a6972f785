/** One surgery: what is now, the stages, the spine, and what can be done. */
import type { VNode } from "preact";
import { useEffect, useMemo, useState } from "preact/hooks";

import { Resource, type ResourceState, useResource } from "../api/resource";
import type { StagePage, Surgery, SurgerySummary } from "../api/types";
import { href, paths } from "../app/route";
import { ExportsPanel } from "../exports/exports-panel";
import { GlancePanel } from "../glance/glance-panel";
import { permits } from "../state/session";
import { StagePanel } from "../timeline/stage-panel";
import { type StageGroup, stageGroups } from "../timeline/stages";
import { Timeline } from "../timeline/timeline";
import { useStages } from "../timeline/use-stages";
import { focusUpload, UploadPanel } from "../upload/upload-panel";
import { AttributionPanel, MeasuresPanel, SpinePanel, VertebraTable } from "./result-panels";
import "./surgery-page.css";

interface SurgeryPageProps {
  id: string;
  /** The stage whose details are shown; null follows the newest one. */
  stage: string | null;
}

/** The page of a surgery. */
export function SurgeryPage({ id, stage }: SurgeryPageProps): VNode {
  const path = `/v1/surgeries/${encodeURIComponent(id)}`;
  const surgery = useResource<Surgery>(path);
  const summary = useResource<SurgerySummary>(`${path}/summary`);
  const stages = useStages(id);
  const reference = surgery.state === "ready" ? surgery.value.reference : null;
  useEffect(() => {
    document.title = `${reference ?? "Surgery"} · Spinewatch`;
  }, [reference]);
  return (
    <>
      <Heading id={id} surgery={surgery} stage={stage} />
      <Resource of={surgery} loading="Loading the surgery">
        {() => (
          <Resource of={stages} loading="Loading the stages">
            {(page, stale) => <Content id={id} stage={stage} page={page} stale={stale} summary={summary} />}
          </Resource>
        )}
      </Resource>
    </>
  );
}

function Heading({ id, surgery, stage }: { id: string; surgery: ResourceState<Surgery>; stage: string | null }): VNode {
  const known = surgery.state === "ready" ? surgery.value : null;
  return (
    <div class="page-heading">
      <h1>{known?.reference ?? "Surgery"}</h1>
      {known !== null && (
        <p class="muted">
          Markers on {known.vertebrae.join(", ")}; reference {known.reference_vertebra}
        </p>
      )}
      <nav class="row no-print" aria-label="Pages of the surgery">
        {permits("capture:write") && (
          <button type="button" class="button button-small button-primary" onClick={focusUpload}>
            Add a stage
          </button>
        )}
        {stage !== null && (
          <a class="button button-small" href={href(paths.surgery(id))}>
            Follow the newest stage
          </a>
        )}
        <a class="button button-small" href={href(paths.setup(id))}>
          Setup of the spine
        </a>
        <a class="button button-small" href={href(paths.radiographs(id))}>
          Radiographs
        </a>
      </nav>
    </div>
  );
}

interface ContentProps {
  id: string;
  stage: string | null;
  page: StagePage;
  stale: boolean;
  summary: ResourceState<SurgerySummary>;
}

function Content({ id, stage, page, stale, summary }: ContentProps): VNode {
  const [retakeOf, setRetakeOf] = useState<string | null>(null);
  const known = summary.state === "ready" ? summary.value : null;
  const groups = useMemo(() => stageGroups(page.items, known), [page, known]);
  const selected = selectedGroup(groups, stage);
  const shown = selected?.counted.state === "succeeded" ? selected.name : null;
  return (
    <div class="surgery">
      {groups.length === 0 ? (
        <div class="empty">
          <p>No stages yet.</p>
          <p class="small">Drop the two images of the first one here, or send it from a cart; it appears by itself.</p>
        </div>
      ) : (
        <>
          <Resource of={summary} loading="Loading the measures">
            {(value, old) => <GlancePanel summary={value} groups={groups} stale={old || stale} />}
          </Resource>
          <Timeline surgeryId={id} groups={groups} summary={known} selected={selected?.name ?? null} />
        </>
      )}
      {stage !== null && selected === null && <p class="notice notice-warning">There is no stage {stage} in this surgery.</p>}
      <div class="surgery-columns">
        <div class="stack">
          {shown !== null && <SpinePanel surgeryId={id} stage={shown} />}
          {selected !== null && <StagePanel surgeryId={id} group={selected} summary={known} onRetake={setRetakeOf} />}
          {permits("capture:write") && <UploadPanel surgeryId={id} groups={groups} retakeOf={retakeOf} />}
        </div>
        <div class="stack">
          {shown !== null && <MeasuresPanel surgeryId={id} stage={shown} />}
          <ExportsPanel surgeryId={id} />
        </div>
      </div>
      {shown !== null && (
        <>
          <AttributionPanel surgeryId={id} stage={shown} />
          <VertebraTable surgeryId={id} stage={shown} />
        </>
      )}
      {page.next_cursor !== null && (
        <p class="muted small">
          The newest {page.items.length} of {page.total} takes are shown.
        </p>
      )}
    </div>
  );
}

/** The stage of the address, or the newest one that is measured, or else the newest one. */
function selectedGroup(groups: readonly StageGroup[], name: string | null): StageGroup | null {
  if (name !== null) return groups.find((group) => group.name === name) ?? null;
  return groups.findLast(({ counted }) => counted.state === "succeeded") ?? groups.at(-1) ?? null;
}
