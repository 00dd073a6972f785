/** Saving digitized landmarks as the initial configuration of the setup. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { ProblemError, Tagged } from "../api/client";
import type { InitialRadiographs, StoredSpineSetup } from "../api/types";
import { Failure } from "../app/failure";
import { href, paths } from "../app/route";
import { permits } from "../state/session";
import { saveSetup } from "../setup/stored";

interface SaveProps {
  surgeryId: string;
  /** The landmarks; null while there is no fit of them. */
  initial: InitialRadiographs | null;
  stored: Tagged<StoredSpineSetup> | null;
  reload: () => Promise<void>;
  onSaved: () => void;
}

type Saved = { state: "idle" | "busy" | "saved" | "conflict" } | { state: "refused"; problem: ProblemError };

/** The button that saves, and what came of it. */
export function SaveFit({ surgeryId, initial, stored, reload, onSaved }: SaveProps): VNode {
  const [saved, setSaved] = useState<Saved>({ state: "idle" });
  const save = async (): Promise<void> => {
    if (initial === null || stored === null) return;
    setSaved({ state: "busy" });
    const result = await saveSetup(surgeryId, { ...stored.value.setup, initial }, stored);
    if (result.outcome === "refused") return setSaved({ state: "refused", problem: result.problem });
    if (result.outcome === "saved") onSaved();
    setSaved({ state: result.outcome });
    return reload();
  };
  return (
    <section class="panel stack" aria-labelledby="save-title">
      <h2 id="save-title">Initial configuration</h2>
      {stored === null ? (
        <p class="notice">
          The setup of the spine does not exist yet. <a href={href(paths.setup(surgeryId))}>State the patient’s directions</a> first; these
          landmarks stay here meanwhile, and the setup can take them.
        </p>
      ) : (
        <p class="muted">
          Replaces the initial configuration of revision {stored.value.revision} by these landmarks; all spines are then computed again.
        </p>
      )}
      {saved.state === "conflict" && (
        <p class="notice notice-warning" role="alert">
          Somebody stored another setup meanwhile. It has been read: saving again changes only its initial configuration.
        </p>
      )}
      {saved.state === "refused" && <Failure problem={saved.problem} />}
      {saved.state === "saved" && <p class="notice notice-good" role="status">Saved as revision {stored?.value.revision}.</p>}
      {!permits("correct:write") && <p class="muted small">This key may not save: it lacks the scope correct:write.</p>}
      <div class="row">
        <button
          type="button"
          class="button button-primary"
          disabled={initial === null || stored === null || saved.state === "busy" || !permits("correct:write")}
          onClick={() => void save()}
        >
          {saved.state === "busy" ? "Saving …" : "Save into the setup"}
        </button>
      </div>
    </section>
  );
}
