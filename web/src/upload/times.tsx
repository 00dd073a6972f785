/** When the stage was captured, and when each image was exposed. */
import type { VNode } from "preact";

import { type Draft, isoTime } from "./draft";
import type { ChosenFile } from "./files";
import type { Side } from "./pairing";

interface TimesProps {
  draft: Draft<ChosenFile>;
  onChange: (values: Partial<Draft<ChosenFile>>) => void;
}

/** The fields of the times; all may stay empty. */
export function Times({ draft, onChange }: TimesProps): VNode {
  const newest = draft.files.reduce((latest, { content }) => Math.max(latest, content.lastModified), 0);
  const setExposure = (row: number, side: Side, value: string): void => {
    onChange({ exposures: draft.exposures.map((times, index) => (index === row ? { ...times, [side]: value } : times)) });
  };
  return (
    <details class="upload-times">
      <summary>Times of capture and exposure</summary>
      <div class="stack">
        <div class="field">
          <label for="captured-at">Captured at (local time)</label>
          <div class="row">
            <input
              id="captured-at"
              type="datetime-local"
              step="1"
              value={draft.capturedAt}
              onInput={(event) => onChange({ capturedAt: event.currentTarget.value })}
            />
            {newest > 0 && (
              <button type="button" class="button button-small" onClick={() => onChange({ capturedAt: localTime(newest) })}>
                Take the time of the files: {localTime(newest).replace("T", " ")}
              </button>
            )}
          </div>
          <p class="hint">Left empty, the stage has the time at which it is stored only.</p>
        </div>
        {draft.pairs.length > 0 && (
          <table>
            <caption>
              Times of exposure, such as 2026-11-21T09:30:00.250+01:00; without a zone they are local. They show whether
              both views were taken together, and breathing in a burst.
            </caption>
            <thead>
              <tr>
                <th scope="col">Pair</th>
                <th scope="col">Left exposed at</th>
                <th scope="col">Right exposed at</th>
              </tr>
            </thead>
            <tbody>
              {draft.exposures.map((times, row) => (
                <tr>
                  <th scope="row">{row + 1}</th>
                  {(["left", "right"] as const).map((side) => (
                    <td>
                      <input
                        aria-label={`Exposure of the ${side} image of pair ${row + 1}`}
                        aria-invalid={times[side] !== "" && isoTime(times[side]) === null}
                        autocomplete="off"
                        value={times[side]}
                        onInput={(event) => setExposure(row, side, event.currentTarget.value)}
                      />
                    </td>
                  ))}
                </tr>
              ))}
            </tbody>
          </table>
        )}
      </div>
    </details>
  );
}

function localTime(milliseconds: number): string {
  const date = new Date(milliseconds);
  return new Date(milliseconds - date.getTimezoneOffset() * 60_000).toISOString().slice(0, 19);
}
