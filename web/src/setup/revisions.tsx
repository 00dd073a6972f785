/** Every revision of the setup: when, by whom, and what it changed. */
import type { VNode } from "preact";

import { Resource, useResource } from "../api/resource";
import type { SetupRevision, SetupRevisionPage } from "../api/types";
import { dayAndTime } from "../format/time";
import { differences } from "./differences";
import { setupPath } from "./stored";

/** The list of revisions, newest first. */
export function Revisions({ surgeryId }: { surgeryId: string }): VNode {
  const revisions = useResource<SetupRevisionPage>(`${setupPath(surgeryId)}/revisions?limit=50`);
  return (
    <section class="panel stack" aria-labelledby="revisions-title">
      <h2 id="revisions-title">Revisions</h2>
      <Resource of={revisions} loading="Loading the revisions" empty={({ items }) => (items.length === 0 ? "No setup is stored yet." : null)}>
        {({ items }) => (
          <ol class="setup-revisions">
            {items.map((revision, index) => <Revision revision={revision} before={items[index + 1] ?? null} />)}
          </ol>
        )}
      </Resource>
    </section>
  );
}

function Revision({ revision, before }: { revision: SetupRevision; before: SetupRevision | null }): VNode {
  const changes = differences(before?.setup ?? null, revision.setup);
  return (
    <li data-revision={revision.revision}>
      <p>
        <strong>Revision {revision.revision}</strong> <span class="muted small">{dayAndTime(revision.created_at)} by {revision.actor ?? "somebody unknown"}</span>
      </p>
      <ul class="small">
        {changes.map(({ field, before: from, after: to }) => (
          <li>
            <span class="muted">{field}:</span> {before === null ? to : `${from} → ${to}`}
          </li>
        ))}
      </ul>
    </li>
  );
}
