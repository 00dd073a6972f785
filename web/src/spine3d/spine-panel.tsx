/** The panel of the spine in three dimensions on the page of a surgery. */
import type { VNode } from "preact";

import type { SurgerySummary } from "../api/types";
import { Resource, useResource } from "../api/resource";
import { href, paths } from "../app/route";
import { bodiesOf } from "./bodies";
import { SpineView } from "./spine-view";
import "./spine3d.css";

interface SpinePanelProps {
  surgeryId: string;
  stage: string;
}

export function SpinePanel({ surgeryId, stage }: SpinePanelProps): VNode {
  const summary = useResource<SurgerySummary>(`/v1/surgeries/${encodeURIComponent(surgeryId)}/summary`);
  return (
    <section class="panel spine-panel" aria-labelledby="spine-title">
      <header>
        <h2 id="spine-title">Spine in 3D</h2>
        <span class="muted small">stage {stage}</span>
      </header>
      <Resource of={summary} loading="Loading the spine">
        {(value, stale) => <AtStage summary={value} stage={stage} stale={stale} />}
      </Resource>
    </section>
  );
}

function AtStage({ summary, stage, stale }: { summary: SurgerySummary; stage: string; stale: boolean }): VNode {
  const found = summary.stages.find(({ name }) => name === stage);
  const spine = found?.spine ?? null;
  if (spine === null || bodiesOf(spine).length === 0) {
    const reason = found?.spine_reason ?? (found ? "no vertebra has a pose" : "there is no such stage");
    return (
      <div class="empty">
        <p>No spine to draw at stage {stage}: {reason}.</p>
        {summary.setup === null && (
          <p>
            <a href={href(paths.setup(summary.surgery_id))}>Set up the spine</a>
          </p>
        )}
      </div>
    );
  }
  return (
    <>
      {stale && <p class="notice notice-warning">The connection is lost: this may not be the newest state.</p>}
      <SpineView summary={summary} spine={spine} />
    </>
  );
}
