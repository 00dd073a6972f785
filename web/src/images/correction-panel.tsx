/** A correction: what it changes, undo, and saving it as a new take. */
import type { VNode } from "preact";

import type { ProblemError } from "../api/client";
import { Failure } from "../app/failure";
import { type Draft, type Change } from "./draft";

interface CorrectionPanelProps {
  draft: Draft;
  changes: readonly Change[];
  /** What is wrong with the correction; null when it can be saved. */
  wrong: string | null;
  /** Why it cannot be saved now, shown elsewhere in full. */
  blocked: boolean;
  nextTake: number;
  adding: boolean;
  saving: boolean;
  problem: ProblemError | null;
  onAdding: (adding: boolean) => void;
  onUndo: () => void;
  onRedo: () => void;
  onSave: () => void;
  onLeave: () => void;
}

/** The panel of a correction. */
export function CorrectionPanel(props: CorrectionPanelProps): VNode {
  const { draft, changes, wrong, saving } = props;
  return (
    <section class="panel stack correction no-print" aria-labelledby="correction-heading">
      <header>
        <h2 id="correction-heading">Correction</h2>
        <span class="button-group">
          <button type="button" class="button button-small" disabled={draft.count === 0 || saving} onClick={props.onUndo}>
            Undo
          </button>
          <button type="button" class="button button-small" disabled={draft.count === draft.edits.length || saving} onClick={props.onRedo}>
            Redo
          </button>
        </span>
      </header>
      <button
        type="button"
        class="button button-small"
        aria-pressed={props.adding}
        onClick={() => props.onAdding(!props.adding)}
      >
        {props.adding ? "Click in an image to add a ball centre" : "Add a ball centre"}
      </button>
      {changes.length === 0 ? (
        <p class="muted small">
          Nothing is changed yet. Choose a ball: drag it, move it with the arrow keys, or change the label of its triad.
        </p>
      ) : (
        <div>
          <h3 class="label">
            {changes.length} {changes.length === 1 ? "change" : "changes"}
          </h3>
          <ol class="changes" aria-label="Changes of this correction">
            {changes.map((change) => (
              <li>
                <span class="change-text">{change.text}</span>
                {change.detail !== null && <span class="muted small block">{change.detail}</span>}
              </li>
            ))}
          </ol>
        </div>
      )}
      <p class="visually-hidden" role="status">
        {changes.length === 0 ? "" : `${changes.length} changes; the last: ${changes.at(-1)?.text ?? ""}`}
      </p>
      {wrong !== null && <p class="notice notice-warning" role="alert">{wrong}</p>}
      {props.problem !== null && <Failure problem={props.problem} />}
      <div class="row">
        <button
          type="button"
          class="button button-primary"
          disabled={changes.length === 0 || wrong !== null || props.blocked || saving}
          onClick={props.onSave}
        >
          {saving ? "Saving …" : `Save as take ${props.nextTake}`}
        </button>
        <button type="button" class="button" disabled={saving} onClick={props.onLeave}>
          {changes.length === 0 ? "Stop correcting" : "Discard"}
        </button>
      </div>
      <p class="small muted">
        The take that is corrected is kept. Your key is stored with the correction, in the list of takes and in the audit.
      </p>
    </section>
  );
}
