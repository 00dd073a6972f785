/** Two people changed the setup: what each of them did, and how to go on. */
import type { VNode } from "preact";

import type { SpineSetup, StoredSpineSetup } from "../api/types";
import { differences } from "./differences";

interface ConflictProps {
  base: SpineSetup | null;
  mine: SpineSetup;
  theirs: StoredSpineSetup;
  onTheirs: () => void;
  onBoth: () => void;
}

/** The choice after a conflict. */
export function Conflict({ base, mine, theirs, onTheirs, onBoth }: ConflictProps): VNode {
  return (
    <section class="notice notice-warning" role="alert" aria-labelledby="conflict-title">
      <h2 id="conflict-title">Somebody stored revision {theirs.revision} meanwhile</h2>
      <p>Nothing was overwritten. Compare, then go on from theirs or carry your change over to it.</p>
      <div class="setup-pair">
        <Side title="Theirs" base={base} setup={theirs.setup} />
        <Side title="Yours" base={base} setup={mine} />
      </div>
      <div class="row">
        <button type="button" class="button" onClick={onTheirs}>Discard mine, show theirs</button>
        <button type="button" class="button button-primary" onClick={onBoth}>Carry my change over to theirs</button>
      </div>
    </section>
  );
}

function Side({ title, base, setup }: { title: string; base: SpineSetup | null; setup: SpineSetup }): VNode {
  const changes = differences(base, setup);
  return (
    <div>
      <h3>{title}</h3>
      {changes.length === 0 ? (
        <p class="muted small">no change</p>
      ) : (
        <ul class="small">
          {changes.map(({ field, before, after }) => (
            <li>
              <span class="muted">{field}:</span> {base === null ? after : `${before} → ${after}`}
            </li>
          ))}
        </ul>
      )}
    </div>
  );
}
