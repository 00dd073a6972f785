/** Somebody else made a newer take while a correction was being made: carry it over, or discard it. */
import type { VNode } from "preact";

import { Resource } from "../api/resource";
import type { Stage } from "../api/types";
import { dayAndTime } from "../format/time";
import { pairsOf, useTake } from "./documents";
import type { Draft } from "./draft";
import { rebased } from "./rebase";
import { sceneOf, type Scene } from "./scene";

interface ConflictNoticeProps {
  draft: Draft;
  /** The take that is being corrected, and the newer one. */
  scene: Scene;
  newer: Stage;
  pair: number;
  onCarry: (draft: Draft, lost: readonly string[]) => void;
  onDiscard: () => void;
}

/** The notice, with both ways out. */
export function ConflictNotice({ draft, scene, newer, pair, onCarry, onDiscard }: ConflictNoticeProps): VNode {
  const documents = useTake(newer, pair);
  const by = newer.revision?.by;
  return (
    <div class="notice notice-warning" role="alert">
      <strong>Take {newer.take} was made meanwhile</strong>
      <p>
        {by === undefined ? "New images were measured" : `${by} corrected this stage`} on {dayAndTime(newer.revision?.at ?? newer.created_at)}.
        Your correction is of take {scene.take} and cannot be saved as it is.
      </p>
      <Resource of={documents} loading={`Loading take ${newer.take}`}>
        {(ready) => {
          const result = rebased(draft, scene, sceneOf(ready.triads, ready.features, ready.candidates, scene.vertebrae, pairsOf(newer) > 1));
          const hasOwnImages = newer.revision == null;
          return (
            <>
              {!hasOwnImages && result.lost.length > 0 && (
                <ul class="small">
                  {result.lost.map((sentence) => (
                    <li>{sentence}</li>
                  ))}
                </ul>
              )}
              <div class="row">
                {!hasOwnImages && (
                  <button
                    type="button"
                    class="button button-primary"
                    disabled={result.draft.count === 0}
                    onClick={() => onCarry(result.draft, result.lost)}
                  >
                    Carry over to take {newer.take}
                  </button>
                )}
                <button type="button" class="button" onClick={onDiscard}>
                  Discard my correction
                </button>
              </div>
            </>
          );
        }}
      </Resource>
    </div>
  );
}
