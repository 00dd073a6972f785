/** The controls above the picture. */
import type { VNode } from "preact";

import type { Switches } from "./content";
import { type NamedView, VIEWS } from "./views";

export type PlanMode = "hidden" | "over" | "beside";

/** Compared with every stage at once; no stage has such a name. */
export const ALL_STAGES = "*";

export interface Settings {
  readonly switches: Switches;
  /** Name of a stage, `ALL_STAGES`, or nothing. */
  readonly compared: string | null;
  readonly plan: PlanMode;
}

interface ControlsProps {
  id: string;
  settings: Settings;
  stage: string;
  stages: readonly string[];
  hasPlan: boolean;
  /** Why there are no triads to draw. */
  triadsReason: string | null;
  current: NamedView | null;
  onChange: (change: Partial<Settings>) => void;
  onView: (name: NamedView) => void;
  onFit: () => void;
}

const NAMES: readonly (readonly [Exclude<keyof Switches, "regions">, string])[] = [
  ["shapes", "Shapes"],
  ["vectors", "Body vectors"],
  ["triads", "Triads"],
  ["line", "Spine line"],
];

export function Controls(props: ControlsProps): VNode {
  const { id, settings, stage, stages, onChange } = props;
  const others = stages.filter((name) => name !== stage);
  return (
    <div class="spine-controls no-print">
      <div class="button-group" role="group" aria-label="Direction of view">
        {(Object.keys(VIEWS) as NamedView[]).map((name) => (
          <button
            type="button"
            class="button button-small"
            aria-pressed={props.current === name}
            title={VIEWS[name].title}
            onClick={() => props.onView(name)}
          >
            {VIEWS[name].label}
          </button>
        ))}
        <button type="button" class="button button-small" title="Show everything" onClick={props.onFit}>
          Fit
        </button>
      </div>
      <div class="row" role="group" aria-label="Shown">
        {NAMES.map(([name, label]) => {
          const reason = name === "triads" ? props.triadsReason : null;
          return (
            <label class="spine-switch" title={reason ?? undefined}>
              <input
                type="checkbox"
                checked={settings.switches[name] && reason === null}
                disabled={reason !== null}
                onChange={(event) =>
                  onChange({ switches: { ...settings.switches, [name]: event.currentTarget.checked } })
                }
              />
              {label}
            </label>
          );
        })}
      </div>
      <div class="row">
        {others.length > 0 && (
          <div class="spine-choice">
            <label for={`${id}-compared`}>Compare with</label>
            <select
              id={`${id}-compared`}
              value={settings.compared ?? ""}
              onChange={(event) => onChange({ compared: event.currentTarget.value || null })}
            >
              <option value="">nothing</option>
              {others.map((name) => (
                <option value={name}>{name}</option>
              ))}
              {stages.length > 2 && <option value={ALL_STAGES}>all {stages.length} stages</option>}
            </select>
          </div>
        )}
        <div class="spine-choice">
          <label for={`${id}-regions`}>95% regions</label>
          <select
            id={`${id}-regions`}
            value={settings.switches.regions}
            onChange={(event) =>
              onChange({ switches: { ...settings.switches, regions: Number(event.currentTarget.value) } })
            }
          >
            <option value="0">hidden</option>
            <option value="1">true size</option>
            <option value="5">5 times larger</option>
          </select>
        </div>
        {props.hasPlan && (
          <div class="spine-choice">
            <label for={`${id}-plan`}>Plan</label>
            <select
              id={`${id}-plan`}
              value={settings.plan}
              onChange={(event) => onChange({ plan: event.currentTarget.value as PlanMode })}
            >
              <option value="hidden">hidden</option>
              <option value="over">laid over</option>
              <option value="beside">beside</option>
            </select>
          </div>
        )}
      </div>
    </div>
  );
}
