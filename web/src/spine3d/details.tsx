/** The selected vertebra: chosen in the picture, in the table or here; its pose with deviations. */
import type { VNode } from "preact";

import type { StageSpine, VertebraState } from "../api/types";
import { apexAndSide } from "../format/curve";
import { Quantity } from "../format/quantity";
import { StatusMark } from "../format/status-mark";
import { selectedVertebra } from "../state/selection";

/** The chooser and the numbers. */
export function Details({ spine, id }: { spine: StageSpine; id: string }): VNode {
  const selected = spine.vertebrae.find((state) => state.vertebra === selectedVertebra.value);
  return (
    <div class="spine-details">
      <div class="field">
        <label for={`${id}-vertebra`}>Vertebra at {spine.stage}</label>
        <select
          id={`${id}-vertebra`}
          value={selected?.vertebra ?? ""}
          onChange={(event) => (selectedVertebra.value = event.currentTarget.value || null)}
        >
          <option value="">none selected</option>
          {spine.vertebrae.map((state) => (
            <option value={state.vertebra}>{state.vertebra}</option>
          ))}
        </select>
      </div>
      {selected === undefined ? (
        <p class="muted small">Click a vertebra, or choose it here, for its pose.</p>
      ) : (
        <Pose state={selected} frame={spine.frame} />
      )}
      {spine.curves.length > 0 && (
        <div>
          <h3>Curves at {spine.baseline.name}</h3>
          <ul class="spine-curves">
            {spine.curves.map((curve) => (
              <li>
                {curve.name}: {curve.upper} to {curve.lower}, {apexAndSide(curve)}
              </li>
            ))}
          </ul>
        </div>
      )}
    </div>
  );
}

function Pose({ state, frame }: { state: VertebraState; frame: string }): VNode {
  const { position_mm: at, position_sd_mm: sd, reason, position_reason: origin } = state;
  const angles = [
    ["Coronal tilt", "+ left side up", state.coronal_tilt_deg, state.coronal_tilt_sd_deg],
    ["Sagittal tilt", "+ leans forwards", state.sagittal_tilt_deg, state.sagittal_tilt_sd_deg],
    ["Axial rotation", "+ anterior turns left", state.axial_rotation_deg, state.axial_rotation_sd_deg],
  ] as const;
  return (
    <div aria-live="polite">
      <p>
        <strong>{state.vertebra}</strong> <StatusMark status={state.origin} named />
      </p>
      <dl class="spine-numbers">
        {(["Anterior", "Left", "Cephalad"] as const).map((name, k) => (
          <div>
            <dt>{name}</dt>
            <dd>
              <Quantity value={at?.[k]} sd={sd?.[k]} unit="mm" reason={reason} />
            </dd>
          </div>
        ))}
        {angles.map(([name, sign, value, deviation]) => (
          <div>
            <dt>
              {name} <span class="spine-sign">{sign}</span>
            </dt>
            <dd>
              <Quantity value={value} sd={deviation} unit="deg" reason={reason} />
            </dd>
          </div>
        ))}
        <div>
          <dt>
            Displacement <span class="spine-sign">+ right</span>
          </dt>
          <dd>
            <Quantity
              value={state.lateral_displacement_mm}
              sd={state.lateral_displacement_sd_mm}
              unit="mm"
              reason={reason ?? state.not_measured_reason ?? null}
            />
          </dd>
        </div>
      </dl>
      {(reason ?? origin) != null && <p class="small">{reason ?? origin}</p>}
      <p class="muted small">± one standard deviation; {frame}.</p>
    </div>
  );
}
