/** Beside the films: the landmark that is placed now, its coordinates, and all landmarks by vertebra. */
import type { VNode } from "preact";
import { useLayoutEffect, useState } from "preact/hooks";

import { fixed } from "../format/numbers";
import type { Action, Editor } from "./editor";
import type { Band } from "./geometry";
import { isOptional, KINDS, type Point, pointAt, progress, sameSlot, type Slot, slotKey, slotLabel, VIEW_NAMES, type View } from "./landmarks";

interface SideProps {
  editor: Editor;
  bands: (slot: Slot) => Band | null;
  dispatch: (action: Action) => void;
  onNext: (step: 1 | -1) => void;
}

/** What is placed now. */
export function CurrentLandmark({ editor, bands, dispatch, onNext }: SideProps): VNode {
  const { selected, landmarks } = editor;
  const point = selected === null ? null : pointAt(landmarks, selected);
  const band = selected === null ? null : bands(selected);
  const off = band === null || point === null ? null : point[1] - band.v;
  return (
    <section class="panel stack" aria-labelledby="landmark-now">
      <h2 id="landmark-now">Landmark</h2>
      <div class="now" aria-live="polite">
        <p class="now-name">{selected === null ? "All landmarks are placed" : slotLabel(selected)}</p>
        <p class="small muted">
          {selected === null
            ? "Choose one below to move it."
            : `${VIEW_NAMES[selected.view]} view${isOptional(selected) ? ", optional: gives the axial rotation" : ""}`}
        </p>
        {band !== null && off !== null && (
          <p class={Math.abs(off) > band.halfWidth ? "small badge badge-warning" : "small badge badge-good"}>
            {fixed(off, 1)} px from the {band.subject}
          </p>
        )}
      </div>
      {selected !== null && (
        <Coordinates key={slotKey(selected)} point={point} onPlace={(next) => dispatch({ type: "place", point: next, stay: true })} />
      )}
      <div class="row">
        <button type="button" class="button button-small" onClick={() => onNext(-1)}>Previous</button>
        <button type="button" class="button button-small" onClick={() => onNext(1)}>Next</button>
        {selected !== null && isOptional(selected) && point === null && (
          <button type="button" class="button button-small" onClick={() => dispatch({ type: "skip" })}>Not visible</button>
        )}
        {point !== null && (
          <button type="button" class="button button-small" onClick={() => dispatch({ type: "remove" })}>Remove</button>
        )}
        <button type="button" class="button button-small" disabled={editor.past.length === 0} onClick={() => dispatch({ type: "undo" })}>Undo</button>
        <button type="button" class="button button-small" disabled={editor.future.length === 0} onClick={() => dispatch({ type: "redo" })}>Redo</button>
      </div>
      <details>
        <summary class="small">Keys in a radiograph</summary>
        <dl class="keys small" id="film-keys">
          <dt><kbd>Arrows</kbd></dt><dd>move by 0.1 px; Shift 1, Ctrl 10, Ctrl+Shift 100 px</dd>
          <dt><kbd>Enter</kbd></dt><dd>place, then the next landmark</dd>
          <dt><kbd>n</kbd> <kbd>p</kbd></dt><dd>next, previous landmark</dd>
          <dt><kbd>s</kbd></dt><dd>pass over a pedicle that is not visible</dd>
          <dt><kbd>Del</kbd></dt><dd>take the landmark away</dd>
          <dt><kbd>Ctrl+Z</kbd></dt><dd>undo; with Shift redo</dd>
          <dt><kbd>+</kbd> <kbd>-</kbd> <kbd>0</kbd></dt><dd>zoom in, out, whole image; also the wheel, and dragging</dd>
        </dl>
      </details>
    </section>
  );
}

/** Coordinates that can be typed. */
function Coordinates({ point, onPlace }: { point: Point | null; onPlace: (point: Point) => void }): VNode {
  const [u, setU] = useState("");
  const [v, setV] = useState("");
  // before the fields are painted: later it would overwrite what is typed at once
  useLayoutEffect(() => {
    setU(point === null ? "" : String(point[0]));
    setV(point === null ? "" : String(point[1]));
  }, [point?.[0], point?.[1]]);
  const [x, y] = [Number(u), Number(v)];
  const isWhole = u.trim() !== "" && v.trim() !== "" && Number.isFinite(x) && Number.isFinite(y);
  return (
    <form
      class="coordinates"
      onSubmit={(event) => {
        event.preventDefault();
        if (isWhole) onPlace([x, y]);
      }}
    >
      <div class="field">
        <label for="landmark-u">u, px to the right</label>
        <input id="landmark-u" inputMode="decimal" value={u} onInput={(event) => setU(event.currentTarget.value)} />
      </div>
      <div class="field">
        <label for="landmark-v">v, px down</label>
        <input id="landmark-v" inputMode="decimal" value={v} onInput={(event) => setV(event.currentTarget.value)} />
      </div>
      <button type="submit" class="button button-small" disabled={!isWhole}>
        {point === null ? "Place there" : "Move there"}
      </button>
    </form>
  );
}

const SHORT: Readonly<Record<string, string>> = {
  superior_left: "↖",
  superior_right: "↗",
  inferior_left: "↙",
  inferior_right: "↘",
  pedicle_left: "●",
  pedicle_right: "●",
  superior_anterior: "↖",
  superior_posterior: "↗",
  inferior_anterior: "↙",
  inferior_posterior: "↘",
};

/** Every landmark of every vertebra, to choose one. */
export function LandmarkTable({ editor, dispatch }: Pick<SideProps, "editor" | "dispatch">): VNode {
  const total = (view: View): string => {
    const { placed, needed } = progress(editor.landmarks, view);
    return `${placed} of ${needed}`;
  };
  const dot = (slot: Slot, mark: string): VNode => {
    const point = pointAt(editor.landmarks, slot);
    const place = point === null ? "not placed" : `at ${fixed(point[0], 1)}, ${fixed(point[1], 1)} px`;
    const label = `${slotLabel(slot)}, ${VIEW_NAMES[slot.view]} view, ${place}`;
    return (
      <button
        type="button"
        class={point === null ? "dot" : "dot dot-placed"}
        aria-current={sameSlot(slot, editor.selected) ? "true" : undefined}
        aria-label={label}
        title={label}
        onClick={() => dispatch({ type: "select", slot })}
      >
        <span aria-hidden="true">{mark}</span>
      </button>
    );
  };
  return (
    <div class="landmark-table" tabIndex={0} role="region" aria-label="All landmarks">
      <table>
        <thead>
          <tr>
            <th scope="col">Vertebra</th>
            <th scope="col">PA <span class="muted">{total("pa")}</span></th>
            <th scope="col">Lateral <span class="muted">{total("lateral")}</span></th>
          </tr>
        </thead>
        <tbody>
          {editor.landmarks.vertebrae.map(({ vertebra }) => (
            <tr key={vertebra}>
              <th scope="row">{vertebra}</th>
              {(["pa", "lateral"] as const).map((view) => (
                <td>
                  <span class="dots">
                    {KINDS[view].map(({ name }) => dot({ kind: "vertebra", view, vertebra, name }, SHORT[name] ?? "+"))}
                  </span>
                </td>
              ))}
            </tr>
          ))}
          {editor.landmarks.common.map(({ name }) => (
            <tr key={`common ${name}`}>
              <th scope="row">{name}</th>
              {(["pa", "lateral"] as const).map((view) => (
                <td>{dot({ kind: "common", view, name }, "◆")}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
