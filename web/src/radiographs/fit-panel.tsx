/** The seven-parameter fit: scale, rotation, residual of each common point, and how the two views agree. */
import type { VNode } from "preact";

import type { ProblemError } from "../api/client";
import type { Flag, RadiographFit } from "../api/types";
import { Failure } from "../app/failure";
import { fixed, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import type { Action } from "./editor";
import type { Fault } from "./document";

export type FitState =
  | { readonly state: "waiting" }
  | { readonly state: "running" }
  | { readonly state: "failed"; readonly problem: ProblemError }
  | { readonly state: "ready"; readonly fit: RadiographFit };

interface FitProps {
  state: FitState;
  faults: readonly Fault[];
  dispatch: (action: Action) => void;
}

/** The fit, or what is missing for one. */
export function FitPanel({ state, faults, dispatch }: FitProps): VNode {
  return (
    <section class="panel stack" aria-labelledby="fit-title">
      <header>
        <h2 id="fit-title">Fit to object space</h2>
        <span class="muted small">seven parameters: scale, rotation, translation</span>
      </header>
      {faults.length > 0 ? <Faults faults={faults} dispatch={dispatch} /> : <Outcome state={state} />}
    </section>
  );
}

const SHOWN_FAULTS = 8;

function Faults({ faults, dispatch }: { faults: readonly Fault[]; dispatch: (action: Action) => void }): VNode {
  return (
    <>
      <p class="muted">A fit is made as soon as these are settled:</p>
      <ul class="fault-list">
        {faults.slice(0, SHOWN_FAULTS).map(({ text, slot }) => (
          <li>
            {slot === null ? text : (
              <button type="button" class="link-button" onClick={() => dispatch({ type: "select", slot })}>{text}</button>
            )}
          </li>
        ))}
        {faults.length > SHOWN_FAULTS && <li class="muted">and {faults.length - SHOWN_FAULTS} more</li>}
      </ul>
    </>
  );
}

function Outcome({ state }: { state: FitState }): VNode {
  if (state.state === "waiting" || state.state === "running") return <p class="loading" role="status">Fitting …</p>;
  if (state.state === "failed") return <Failure problem={state.problem} />;
  const { fit } = state;
  const worst = Math.max(...fit.residuals.map(({ distance_mm }) => distance_mm), 1e-9);
  return (
    <>
      {fit.flags.map((flag) => <FitFlag flag={flag} />)}
      {fit.left_out.length > 0 && (
        <p class="notice notice-warning">Left out, because the stage has no pose of their triad: {fit.left_out.join(", ")}</p>
      )}
      <dl class="fit-figures">
        <div class="figure">
          <dt>Scale to true millimetres</dt>
          <dd data-fit="scale"><Quantity value={fit.scale} sd={fit.scale_sd} unit="" digits={4} /></dd>
        </div>
        <div class="figure">
          <dt>RMS of the residuals</dt>
          <dd data-fit="rms"><Quantity value={fit.rms_mm} unit="mm" digits={2} /></dd>
        </div>
        <div class="figure">
          <dt>Rotation about object X, Y, Z, sd</dt>
          <dd>{fit.tilt_sd_deg.map((sd) => withUnit(fixed(sd, 2), "deg")).join("  ")}</dd>
        </div>
        <div class="figure">
          <dt>Heights, PA less lateral</dt>
          <dd><Quantity value={fit.height_offset_mm} unit="mm" digits={1} /> <span class="small muted">rest {fixed(fit.height_rms_mm, 2)} mm RMS</span></dd>
        </div>
        {fit.enlargement > 1 && (
          <div class="figure">
            <dt>Deviations enlarged by</dt>
            <dd>{fixed(fit.enlargement, 2)}</dd>
          </div>
        )}
      </dl>
      <div class="scroll-x" tabIndex={0} role="region" aria-label="Residuals">
        <table>
          <caption>Residuals: place in object space less place by the radiographs, object axes, mm</caption>
          <thead>
            <tr>
              <th scope="col">Common point</th>
              <th scope="col" class="number">X</th>
              <th scope="col" class="number">Y</th>
              <th scope="col" class="number">Z</th>
              <th scope="col" class="number">distance</th>
              <th scope="col"><span class="visually-hidden">Bar of the distance</span></th>
            </tr>
          </thead>
          <tbody>
            {fit.residuals.map((residual) => (
              <tr class={residual.doubtful ? "residual-doubtful" : ""} data-residual={residual.name}>
                <th scope="row">{residual.name}{residual.doubtful && <span class="badge badge-warning">doubtful</span>}</th>
                {residual.residual_mm.map((value) => <td class="number">{fixed(value, 2)}</td>)}
                <td class="number" data-distance>{fixed(residual.distance_mm, 2)}</td>
                <td><span class="residual-bar" style={{ width: `${(100 * residual.distance_mm) / worst}%` }} /></td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

function FitFlag({ flag }: { flag: Flag }): VNode {
  return (
    <p class="notice notice-warning" role="alert">
      <strong>{flag.code === "radiograph-scale" ? "Scale alarm" : flag.code.replaceAll("-", " ")}</strong>
      <span>{flag.detail}</span>
    </p>
  );
}
