/** The initial configuration: poses of a file, radiographs, or none. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { Surgery, VertebraPose } from "../api/types";
import { href, paths } from "../app/route";
import { fixed } from "../format/numbers";
import { StatusMark } from "../format/status-mark";
import { levelsOf } from "../radiographs/levels";
import { FieldFault } from "./axes-fields";
import type { Fault, InitialChoice, SetupForm } from "./form";
import { CSV_HEAD, initialPoses, parsePoses } from "./poses-file";

interface InitialProps {
  form: SetupForm;
  surgery: Surgery;
  faults: readonly Fault[];
  change: (form: SetupForm) => void;
}

const CHOICES: readonly (readonly [InitialChoice, string, string])[] = [
  ["poses", "Poses from a file or typed in", "from another system, CT or EOS"],
  ["radiographs", "Radiographs", "landmarks on a PA and a lateral view"],
  ["generic", "None", "a generic spine is fitted to the triads; every value that depends on it is marked assumed"],
];

/** The fields of the initial configuration. */
export function InitialFields({ form, surgery, faults, change }: InitialProps): VNode {
  const known = levelsOf(surgery.extra_levels);
  return (
    <section class="panel stack" aria-labelledby="initial-title">
      <h2 id="initial-title">Initial configuration</h2>
      <fieldset class="stack setup-choices">
        <legend class="visually-hidden">How the bodies lie at the baseline stage</legend>
        {CHOICES.map(([kind, label, hint]) => (
          <label class="setup-choice">
            <input type="radio" name="initial" checked={form.initial === kind} onChange={() => change({ ...form, initial: kind })} />
            <span>
              {label} {kind === "generic" && <StatusMark status="assumed" />}
              <span class="muted small"> {hint}</span>
            </span>
          </label>
        ))}
      </fieldset>
      {form.initial === "generic" && (
        <div class="setup-pair">
          {(["cranial", "caudal"] as const).map((end) => (
            <div class="field">
              <label for={`setup-${end}`}>{end === "cranial" ? "Most cranial vertebra" : "Most caudal vertebra"}</label>
              <select
                id={`setup-${end}`}
                value={form.generic[end]}
                onChange={(event) => change({ ...form, generic: { ...form.generic, [end]: event.currentTarget.value } })}
              >
                {known.map((name) => <option value={name}>{name}</option>)}
              </select>
            </div>
          ))}
        </div>
      )}
      {form.initial === "poses" && <Poses form={form} change={change} />}
      {form.initial === "radiographs" && (
        <p>
          {form.radiographs === null
            ? "There are no landmarks yet. "
            : `${form.radiographs.vertebrae.length} vertebrae and ${form.radiographs.common.length} common points. `}
          <a href={href(paths.radiographs(surgery.id))}>{form.radiographs === null ? "Digitize the radiographs" : "Look at them"}</a>
        </p>
      )}
      <FieldFault faults={faults} field="initial" />
    </section>
  );
}

/** Poses of a file, or typed as CSV. */
function Poses({ form, change }: Pick<InitialProps, "form" | "change">): VNode {
  const [text, setText] = useState("");
  const [fault, setFault] = useState<string | null>(null);
  const frame = form.poses?.frame ?? "patient";
  const take = (content: string): void => {
    setText(content);
    const parsed = parsePoses(content);
    setFault(parsed.fault);
    if (parsed.items !== null) change({ ...form, poses: initialPoses(parsed.items, frame) });
  };
  return (
    <div class="stack">
      <div class="setup-pair">
        <div class="field">
          <label for="setup-poses-file">CSV or JSON file</label>
          <input
            id="setup-poses-file"
            type="file"
            accept=".csv,.json,text/csv,application/json"
            onChange={(event) => {
              const file = event.currentTarget.files?.[0];
              if (file !== undefined) void file.text().then(take);
            }}
          />
        </div>
        <div class="field">
          <label for="setup-frame">Axes of the positions</label>
          <select
            id="setup-frame"
            value={frame}
            onChange={(event) => {
              const chosen = event.currentTarget.value as "object" | "patient";
              if (form.poses !== null) change({ ...form, poses: { ...form.poses, frame: chosen } });
            }}
            disabled={form.poses === null}
          >
            <option value="patient">patient axes, placed by the triads</option>
            <option value="object">object space of the baseline stage</option>
          </select>
        </div>
      </div>
      <div class="field">
        <label for="setup-poses-text">or type them: one vertebra a line, mm and degrees</label>
        <textarea id="setup-poses-text" rows={4} spellcheck={false} placeholder={CSV_HEAD} value={text} onInput={(event) => take(event.currentTarget.value)} />
        {fault !== null && <span class="wrong" role="alert">{fault}</span>}
      </div>
      {form.poses !== null && <PoseTable poses={form.poses.poses} />}
    </div>
  );
}

function PoseTable({ poses }: { poses: readonly VertebraPose[] }): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label="Poses">
      <table>
        <caption>{poses.length} poses: centroid in mm; coronal (left side up), sagittal and axial angle in degrees, patient axes</caption>
        <thead>
          <tr>
            <th scope="col">Vertebra</th>
            {["x", "y", "z", "coronal", "sagittal", "axial"].map((name) => <th scope="col" class="number">{name}</th>)}
          </tr>
        </thead>
        <tbody>
          {poses.map((pose) => (
            <tr>
              <th scope="row">{pose.vertebra}</th>
              {pose.position_mm.map((value) => <td class="number">{fixed(value, 1)}</td>)}
              {(pose.angles_deg ?? [null, null, null]).map((value) => (
                <td class="number">{value === null ? <span title="given as a rotation matrix">matrix</span> : fixed(value, 1)}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
