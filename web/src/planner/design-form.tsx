/** The form of one design. */
import type { VNode } from "preact";

import { useResource } from "../api/resource";
import type { CalibrationPage } from "../api/types";
import { BALL_FIELD, type Design, DISC_FIELD, type Field, isUsed, LEG_FIELDS, type NumberField, RIG_FIELDS, TRIAD_FIELDS } from "./design";

interface FormProps {
  name: "A" | "B";
  design: Design;
  faults: Partial<Record<Field, string>>;
  change: (design: Design) => void;
}

/** All fields of a design. */
export function DesignForm({ name, design, faults, change }: FormProps): VNode {
  const calibrations = useResource<CalibrationPage>("/v1/calibrations?limit=100");
  const listed = calibrations.state === "ready" ? calibrations.value.items.filter(({ rig }) => rig !== null) : [];
  const isKnown = design.calibration_id === "" || listed.some(({ id }) => id === design.calibration_id);
  const id = (field: string): string => `design-${name}-${field}`;
  const fields = (list: readonly NumberField[]): (VNode | null)[] =>
    list.map((field) => (isUsed(design, field.name) ? <NumberInput key={field.name} id={id(field.name)} field={field} design={design} faults={faults} change={change} /> : null));
  return (
    <form class="design stack" aria-label={`Design ${name}`} onSubmit={(event) => event.preventDefault()}>
      <fieldset class="stack">
        <legend>Rig</legend>
        <div class="field">
          <label for={id("calibration")}>Cameras</label>
          <select id={id("calibration")} value={design.calibration_id} onChange={(event) => change({ ...design, calibration_id: event.currentTarget.value })}>
            <option value="">to be built</option>
            {!isKnown && <option value={design.calibration_id}>calibration {design.calibration_id}</option>}
            {listed.map((calibration) => <option value={calibration.id}>{`calibration ${calibration.name}`}</option>)}
          </select>
        </div>
        <div class="design-fields">{fields(RIG_FIELDS)}</div>
      </fieldset>
      <fieldset class="stack">
        <legend>Marker</legend>
        <div class="design-fields">
          {fields(LEG_FIELDS)}
          <NumberInput id={id(BALL_FIELD.name)} field={BALL_FIELD} design={design} faults={faults} change={change} />
          <NumberInput
            id={id(DISC_FIELD.name)}
            field={DISC_FIELD}
            design={design}
            faults={faults}
            change={change}
            hint="instead of legs: the best marker on its rim"
          />
        </div>
      </fieldset>
      <fieldset class="stack">
        <legend>Spine and errors</legend>
        <div class="design-fields">
          <div class="field design-wide">
            <label for={id("levels")}>Vertebrae, the reference first</label>
            <input
              id={id("levels")}
              value={design.levels}
              maxLength={120}
              aria-invalid={faults.levels !== undefined}
              onInput={(event) => change({ ...design, levels: event.currentTarget.value })}
            />
            {faults.levels !== undefined && <span class="wrong">{faults.levels}</span>}
          </div>
          <div class="field">
            <label for={id("axis")}>Spine along</label>
            <select id={id("axis")} value={design.spine_axis} onChange={(event) => change({ ...design, spine_axis: event.currentTarget.value })}>
              <option value="x">object X</option>
              <option value="y">object Y</option>
            </select>
          </div>
          {fields(TRIAD_FIELDS)}
        </div>
      </fieldset>
    </form>
  );
}

interface InputProps {
  id: string;
  field: NumberField;
  design: Design;
  faults: Partial<Record<Field, string>>;
  change: (design: Design) => void;
  hint?: string;
}

function NumberInput({ id, field, design, faults, change, hint }: InputProps): VNode {
  const fault = faults[field.name];
  return (
    <div class="field">
      <label for={id}>{`${field.label}, ${field.unit}`}</label>
      <input
        id={id}
        inputMode="decimal"
        maxLength={16}
        value={design[field.name]}
        aria-invalid={fault !== undefined}
        aria-describedby={fault === undefined ? undefined : `${id}-fault`}
        onInput={(event) => change({ ...design, [field.name]: event.currentTarget.value })}
      />
      {fault !== undefined ? <span class="wrong" id={`${id}-fault`}>{fault}</span> : hint !== undefined && <span class="hint">{hint}</span>}
    </div>
  );
}
