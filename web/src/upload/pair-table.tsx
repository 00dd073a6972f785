/** Which file is left and right of which pair: shown, and to be changed. */
import type { VNode } from "preact";
import { useEffect, useMemo, useState } from "preact/hooks";

import type { Draft } from "./draft";
import type { ChosenFile } from "./files";
import { assign, exchange, type Side } from "./pairing";

interface PairTableProps {
  draft: Draft<ChosenFile>;
  onChange: (values: Partial<Draft<ChosenFile>>) => void;
}

/** The pairs of a draft. */
export function PairTable({ draft, onChange }: PairTableProps): VNode {
  const { files, pairs, exposures } = draft;
  const place = (row: number, side: Side, value: string): void => {
    onChange({ pairs: assign(pairs, row, side, value === "" ? null : Number(value)), guessed: false });
  };
  const remove = (row: number): void => {
    onChange({ pairs: pairs.filter((_, index) => index !== row), exposures: exposures.filter((_, index) => index !== row) });
  };
  return (
    <div class="stack">
      {draft.guessed && (
        <p class="notice notice-warning" role="alert">
          The names of the files do not say which is left and which is right. Check the assignment.
        </p>
      )}
      <div class="scroll-x upload-pairs" tabIndex={0} role="region" aria-label="Assignment of the files">
        <table>
          <thead>
            <tr>
              <th scope="col">Pair</th>
              <th scope="col">Left</th>
              <th scope="col">Right</th>
              <th scope="col">
                <button type="button" class="button button-small" onClick={() => onChange({ pairs: exchange(pairs, null), guessed: false })}>
                  Exchange all
                </button>
              </th>
            </tr>
          </thead>
          <tbody>
            {pairs.map((pair, row) => (
              <tr>
                <th scope="row">{row + 1}</th>
                {(["left", "right"] as const).map((side) => (
                  <td>
                    <div class="upload-file">
                      <Preview file={files[pair[side] ?? -1] ?? null} />
                      <select
                        aria-label={`${side === "left" ? "Left" : "Right"} image of pair ${row + 1}`}
                        value={pair[side] ?? ""}
                        onChange={(event) => place(row, side, event.currentTarget.value)}
                      >
                        <option value="">none</option>
                        {files.map(({ path }, index) => (
                          <option value={index} selected={pair[side] === index}>
                            {path}
                          </option>
                        ))}
                      </select>
                    </div>
                  </td>
                ))}
                <td>
                  <span class="row">
                    <button
                      type="button"
                      class="button button-small"
                      aria-label={`Exchange left and right of pair ${row + 1}`}
                      onClick={() => onChange({ pairs: exchange(pairs, row), guessed: false })}
                    >
                      Exchange
                    </button>
                    <button type="button" class="button button-small" aria-label={`Remove pair ${row + 1}`} onClick={() => remove(row)}>
                      Remove
                    </button>
                  </span>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </div>
  );
}

/** A small picture of a file, where the browser can show its format. */
function Preview({ file }: { file: ChosenFile | null }): VNode | null {
  const url = useMemo(() => (file === null ? null : URL.createObjectURL(file.content)), [file]);
  const [unreadable, setUnreadable] = useState(false);
  useEffect(() => {
    setUnreadable(false);
    return () => {
      if (url !== null) URL.revokeObjectURL(url);
    };
  }, [url]);
  if (url === null) return null;
  if (unreadable) return <span class="upload-preview muted small">no preview</span>;
  return <img class="upload-preview" src={url} alt="" onError={() => setUnreadable(true)} />;
}
