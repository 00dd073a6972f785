/** The planned configuration, if there is one. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { fixed } from "../format/numbers";
import type { SetupForm } from "./form";
import { parseTarget } from "./poses-file";

/** The fields of the target. */
export function TargetFields({ form, change }: { form: SetupForm; change: (form: SetupForm) => void }): VNode {
  const [text, setText] = useState("");
  const [fault, setFault] = useState<string | null>(null);
  const take = (content: string): void => {
    setText(content);
    if (content.trim() === "") return setFault(null);
    const parsed = parseTarget(content);
    setFault(parsed.fault);
    if (parsed.items !== null) change({ ...form, target: parsed.items });
  };
  return (
    <section class="panel stack" aria-labelledby="target-title">
      <header>
        <h2 id="target-title">Target</h2>
        <span class="muted small">optional: every stage then reports what remains</span>
      </header>
      <div class="setup-pair">
        <div class="field">
          <label for="setup-target-file">CSV file</label>
          <input
            id="setup-target-file"
            type="file"
            accept=".csv,text/csv"
            onChange={(event) => {
              const file = event.currentTarget.files?.[0];
              if (file !== undefined) void file.text().then(take);
            }}
          />
        </div>
        <div class="field">
          <label for="setup-target-text">or typed</label>
          <textarea
            id="setup-target-text"
            rows={2}
            spellcheck={false}
            placeholder="vertebra,coronal_deg,sagittal_deg,axial_deg"
            value={text}
            onInput={(event) => take(event.currentTarget.value)}
          />
          {fault !== null && <span class="wrong" role="alert">{fault}</span>}
        </div>
      </div>
      {form.target === null ? (
        <p class="muted">No target.</p>
      ) : (
        <>
          <table>
            <caption>Planned angles in degrees, patient axes; coronal positive with the left side up</caption>
            <thead>
              <tr>
                <th scope="col">Vertebra</th>
                {["coronal", "sagittal", "axial"].map((name) => <th scope="col" class="number">{name}</th>)}
              </tr>
            </thead>
            <tbody>
              {form.target.map(({ vertebra, angles_deg }) => (
                <tr>
                  <th scope="row">{vertebra}</th>
                  {angles_deg.map((value) => <td class="number">{fixed(value, 1)}</td>)}
                </tr>
              ))}
            </tbody>
          </table>
          <div class="row">
            <button type="button" class="button button-small" onClick={() => change({ ...form, target: null })}>Remove the target</button>
          </div>
        </>
      )}
    </section>
  );
}
