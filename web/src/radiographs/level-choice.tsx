/** Which vertebrae are digitized: from the most cranial to the most caudal one. */
import type { VNode } from "preact";

import type { Surgery } from "../api/types";
import type { Action } from "./editor";
import type { Landmarks } from "./landmarks";
import { levelsOf, span } from "./levels";

interface LevelProps {
  landmarks: Landmarks;
  surgery: Surgery;
  dispatch: (action: Action) => void;
}

/** The span of the vertebrae. */
export function LevelChoice({ landmarks, surgery, dispatch }: LevelProps): VNode {
  const known = levelsOf(surgery.extra_levels);
  const names = landmarks.vertebrae.map(({ vertebra }) => vertebra);
  const [first, last] = [names[0] ?? "", names.at(-1) ?? ""];
  const missing = surgery.vertebrae.filter((name) => !names.includes(name));
  const change = (from: string, to: string): void => dispatch({ type: "levels", vertebrae: span([from, to], surgery.extra_levels) });
  return (
    <section class="panel stack" aria-labelledby="levels-title">
      <h2 id="levels-title">Vertebrae</h2>
      <div class="coordinates">
        <div class="field">
          <label for="level-first">From</label>
          <select id="level-first" value={first} onChange={(event) => change(event.currentTarget.value, last)}>
            {known.map((name) => <option value={name}>{name}</option>)}
          </select>
        </div>
        <div class="field">
          <label for="level-last">To</label>
          <select id="level-last" value={last} onChange={(event) => change(first, event.currentTarget.value)}>
            {known.map((name) => <option value={name}>{name}</option>)}
          </select>
        </div>
      </div>
      {missing.length > 0 && (
        <p class="small badge badge-warning">{missing.join(", ")} with a marker {missing.length === 1 ? "is" : "are"} not among them</p>
      )}
    </section>
  );
}
