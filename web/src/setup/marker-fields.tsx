/** Vertebrae with a marker, the reference, and the baseline stage. */
import type { VNode } from "preact";

import type { Surgery } from "../api/types";
import { FieldFault } from "./axes-fields";
import type { Fault, SetupForm } from "./form";

interface MarkerProps {
  form: SetupForm;
  surgery: Surgery;
  stages: readonly string[];
  faults: readonly Fault[];
  change: (form: SetupForm) => void;
}

/** The fields of markers and stages. */
export function MarkerFields({ form, surgery, stages, faults, change }: MarkerProps): VNode {
  const levels = form.levels ?? surgery.vertebrae;
  const toggle = (name: string, isOn: boolean): void => {
    const chosen = surgery.vertebrae.filter((each) => (each === name ? isOn : levels.includes(each)));
    change({ ...form, levels: chosen.length === surgery.vertebrae.length ? null : chosen });
  };
  return (
    <section class="panel stack" aria-labelledby="markers-title">
      <h2 id="markers-title">Markers and baseline</h2>
      <fieldset class="field">
        <legend>Vertebrae with a marker that are used</legend>
        <div class="row">
          {surgery.vertebrae.map((name) => (
            <label class="row setup-check">
              <input type="checkbox" checked={levels.includes(name)} onChange={(event) => toggle(name, event.currentTarget.checked)} />
              {name}
            </label>
          ))}
        </div>
        <FieldFault faults={faults} field="levels" />
      </fieldset>
      <div class="setup-pair">
        <div class="field">
          <label for="setup-reference">Reference vertebra</label>
          <select id="setup-reference" value={form.reference ?? ""} onChange={(event) => change({ ...form, reference: event.currentTarget.value || null })}>
            <option value="">{`that of the surgery: ${surgery.reference_vertebra}`}</option>
            {levels.map((name) => <option value={name}>{name}</option>)}
          </select>
          <span class="hint">All motion is given in its frame.</span>
        </div>
        <div class="field">
          <label for="setup-baseline">Baseline stage</label>
          <select id="setup-baseline" value={form.baseline ?? ""} onChange={(event) => change({ ...form, baseline: event.currentTarget.value || null })}>
            <option value="">{stages[0] === undefined ? "the first one" : `the first one: ${stages[0]}`}</option>
            {stages.map((name) => <option value={name}>{name}</option>)}
          </select>
          <span class="hint">The stage of the initial configuration.</span>
        </div>
      </div>
    </section>
  );
}
