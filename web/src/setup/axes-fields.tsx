/** How object space lies to the patient: two directions, or three points. */
import type { VNode } from "preact";

import { fixed } from "../format/numbers";
import { anterior, AXES, type DirectionForm, type Fault, type LandmarkName, type SetupForm } from "./form";

interface AxesProps {
  form: SetupForm;
  faults: readonly Fault[];
  change: (form: SetupForm) => void;
}

const POINTS: readonly (readonly [LandmarkName, string])[] = [
  ["caudal_mm", "A point on the midline"],
  ["cephalad_mm", "A point on the midline nearer the head"],
  ["left_mm", "A point to the patient’s left"],
];

/** The fields of the patient axes. */
export function AxesFields({ form, faults, change }: AxesProps): VNode {
  const front = anterior(form);
  return (
    <section class="panel stack" aria-labelledby="axes-title">
      <header>
        <h2 id="axes-title">Patient directions</h2>
        <span class="muted small">in object space of the baseline stage</span>
      </header>
      <fieldset class="row">
        <legend class="visually-hidden">Stated by</legend>
        {(["directions", "landmarks"] as const).map((kind) => (
          <label class="row">
            <input type="radio" name="axes" checked={form.axes === kind} onChange={() => change({ ...form, axes: kind })} />
            {kind === "directions" ? "two directions" : "three points"}
          </label>
        ))}
      </fieldset>
      {form.axes === "directions" ? (
        <div class="setup-pair">
          <Direction name="cephalad" label="To the head" form={form} faults={faults} change={change} />
          <Direction name="left" label="To the patient’s left" form={form} faults={faults} change={change} />
        </div>
      ) : (
        POINTS.map(([name, label]) => (
          <fieldset class="field">
            <legend>{label}, mm</legend>
            <Numbers
              name={name}
              label={label}
              values={form.landmarks[name]}
              onChange={(values) => change({ ...form, landmarks: { ...form.landmarks, [name]: values } })}
            />
            <FieldFault faults={faults} field={name} />
          </fieldset>
        ))
      )}
      <div class="field">
        <label for="setup-axes-sd">
          {form.axes === "directions" ? "Standard deviation of each direction, degrees" : "Standard deviation of each point per axis, mm"}
        </label>
        <input
          id="setup-axes-sd"
          inputMode="decimal"
          placeholder={form.axes === "directions" ? "3" : "7"}
          value={form.axesSd[form.axes]}
          onInput={(event) => change({ ...form, axesSd: { ...form.axesSd, [form.axes]: event.currentTarget.value } })}
        />
        <FieldFault faults={faults} field="axes-sd" />
      </div>
      <p class="small muted">
        {front === null
          ? "The front follows from the head and the left."
          : `The patient’s front is then object (${front.map((value) => fixed(value, 2)).join(", ")}): away from the cameras for a patient who lies prone.`}
      </p>
    </section>
  );
}

interface DirectionProps extends AxesProps {
  name: "cephalad" | "left";
  label: string;
}

function Direction({ name, label, form, faults, change }: DirectionProps): VNode {
  const direction = form[name];
  const set = (next: Partial<DirectionForm>): void => change({ ...form, [name]: { ...direction, ...next } });
  const fault = faults.find(({ field }) => field === name);
  return (
    <div class="field">
      <label for={`setup-${name}`}>{label}</label>
      <select
        id={`setup-${name}`}
        value={direction.choice}
        aria-invalid={fault !== undefined}
        aria-describedby={fault === undefined ? undefined : `setup-${name}-fault`}
        onChange={(event) => set({ choice: event.currentTarget.value as DirectionForm["choice"] })}
      >
        {AXES.map((axis) => (
          <option value={axis}>{`${axis.startsWith("-") ? "\u2212" : "+"}${axis.slice(1).toUpperCase()} of object space`}</option>
        ))}
        <option value="vector">another direction</option>
      </select>
      {direction.choice === "vector" && (
        <Numbers name={name} label={label} values={direction.vector} onChange={(vector) => set({ vector })} />
      )}
      <FieldFault faults={faults} field={name} />
    </div>
  );
}

interface NumbersProps {
  name: string;
  label: string;
  values: readonly [string, string, string];
  onChange: (values: readonly [string, string, string]) => void;
}

/** Three typed numbers along X, Y and Z. */
function Numbers({ name, label, values, onChange }: NumbersProps): VNode {
  return (
    <div class="setup-numbers">
      {["X", "Y", "Z"].map((axis, index) => (
        <input
          id={`setup-${name}-${axis}`}
          aria-label={`${label}: ${axis}`}
          placeholder={axis}
          inputMode="decimal"
          value={values[index]}
          onInput={(event) => {
            const [x, y, z] = values.map((text, i) => (i === index ? event.currentTarget.value : text));
            onChange([x ?? "", y ?? "", z ?? ""]);
          }}
        />
      ))}
    </div>
  );
}

/** What is wrong with a field. */
export function FieldFault({ faults, field }: { faults: readonly Fault[]; field: string }): VNode | null {
  const fault = faults.find((each) => each.field === field);
  return fault === undefined ? null : <span class="wrong" id={`setup-${field}-fault`}>{fault.text}</span>;
}
