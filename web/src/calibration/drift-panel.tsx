/** Drift of the rig over the stages measured with a calibration: control charts and the numbers. */
import type { VNode } from "preact";
import { useMemo } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { CalibrationCheck, CalibrationChecks } from "../api/types";
import { href, paths } from "../app/route";
import { SeverityMark } from "../format/flag-list";
import { flagName, severity } from "../format/flags";
import { fixed, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { dayAndTime } from "../format/time";
import { ControlChart } from "./control-chart";
import { controlPoints, pooled, QUANTITIES } from "./control";

const LIMIT = 200;

/** The drift since a calibration. */
export function DriftPanel({ id }: { id: string }): VNode {
  const checks = useResource<CalibrationChecks>(`/v1/calibrations/${encodeURIComponent(id)}/checks?limit=${LIMIT}`);
  return (
    <section class="panel drift" aria-labelledby="drift-title">
      <header>
        <h2 id="drift-title">Drift of the right camera since the calibration</h2>
      </header>
      <Resource
        of={checks}
        loading="Loading the checks"
        empty={(value) => (value.items.length === 0 ? <p>No stage has been measured with this calibration yet.</p> : null)}
      >
        {(value) => <Drift checks={value} />}
      </Resource>
    </section>
  );
}

function Drift({ checks }: { checks: CalibrationChecks }): VNode {
  const charts = useMemo(
    () => QUANTITIES.map((quantity) => ({ quantity, points: controlPoints(checks.items, quantity.key) })),
    [checks],
  );
  const scale = checks.pooled_scale;
  const moved = checks.items.filter(({ flags }) => flags.some(({ code }) => code === "calibration-drift"));
  return (
    <>
      {moved.length > 0 && (
        <p class="notice notice-error">
          The rig had moved in {moved.length} of {checks.items.length} stages: {moved.map(({ stage }) => stage).reverse().join(", ")}. Calibrate again.
        </p>
      )}
      <p class="muted small">
        Motion of the right camera estimated from the balls of each stage, axes of that camera; oldest stage left. The centre line is the
        rig as calibrated. Limits follow from the deviation of each stage: 95% dashed, 99.7% solid.
        {checks.total > checks.items.length && ` The last ${checks.items.length} of ${checks.total} stages are shown.`}
      </p>
      <ul class="drift-key small" aria-label="Points">
        <li><VerdictMark verdict="inside" /> within the limits</li>
        <li><VerdictMark verdict="warning" /> beyond the 95% limit</li>
        <li><VerdictMark verdict="out" /> out of control: beyond the 99.7% limit, two of three beyond 95% on one side, or eight in a row on one side</li>
      </ul>
      <div class="drift-charts">
        {charts.map(({ quantity, points }) => {
          const mean = pooled(points);
          return (
            <figure data-quantity={quantity.key}>
              <figcaption>
                <strong>{quantity.name}</strong>
                <span class="muted small"> mean <Quantity value={mean?.value} sd={mean?.sd} unit={quantity.unit} digits={quantity.unit === "mm" ? 2 : 3} reason="no stage was checked" />; + {quantity.positive}</span>
              </figcaption>
              {mean === null ? (
                <p class="muted small drift-none">No stage determines it: {[...new Set(points.flatMap(({ reasons }) => reasons))].join("; ")}.</p>
              ) : (
                <ControlChart quantity={quantity} points={points} />
              )}
            </figure>
          );
        })}
      </div>
      {scale !== null && (
        <p class="small">
          Markers of all stages together: {withUnit(fixed(100 * (scale.scale - 1), 3), "%")} ± {withUnit(fixed(100 * Math.hypot(scale.sd, scale.common_sd), 3), "%")} too large over{" "}
          {scale.distances} distances (p = {fixed(scale.p_value, 3)}){scale.drifted ? ": drifted" : ""}.
        </p>
      )}
      <CheckTable items={checks.items} />
    </>
  );
}

function CheckTable({ items }: { items: readonly CalibrationCheck[] }): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label="Checks by stage">
      <table class="check-table">
        <caption>Checks by stage, newest first: rotation about and shift along the right camera's axes</caption>
        <thead>
          <tr>
            <th scope="col">Stage</th>
            <th scope="col">Taken</th>
            <th scope="col" class="number">Age, days</th>
            {["x", "y", "z"].map((axis) => <th scope="col" class="number">Rotation {axis}, °</th>)}
            {["x", "y", "z"].map((axis) => <th scope="col" class="number">Shift {axis}, mm</th>)}
            <th scope="col" class="number">Off lines, px</th>
            <th scope="col" class="number">p</th>
            <th scope="col">Flags</th>
          </tr>
        </thead>
        <tbody>
          {items.map((check) => (
            <tr data-stage={check.stage}>
              <th scope="row">
                <a href={href(paths.stage(check.surgery_id, check.stage))}>{check.stage}</a>
                {check.take > 1 && <span class="muted"> take {check.take}</span>}
              </th>
              <td>{dayAndTime(check.taken_at)}</td>
              <td class="number">{fixed(check.age_days, 1)}</td>
              <Triple values={check.drift?.rotation_deg} sds={check.drift?.rotation_sd_deg} unit="deg" digits={3} />
              <Triple values={check.drift?.shift_mm} sds={check.drift?.shift_sd_mm} unit="mm" digits={2} />
              <td class="number"><Quantity value={check.drift?.rms_px} unit="px" digits={2} reason={TOO_FEW} /></td>
              <td class="number"><Quantity value={check.drift?.p_value} unit="" digits={3} reason={TOO_FEW} /></td>
              <td>
                <ul class="check-flags">
                  {check.flags.map((flag) => (
                    <li title={flag.detail}>
                      <SeverityMark of={severity(flag.code)} size={14} /> {flagName(flag.code)}
                      <span class="visually-hidden">: {flag.detail}</span>
                    </li>
                  ))}
                </ul>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

const TOO_FEW = "no estimate: fewer than six balls were seen in both images";

interface TripleProps {
  values: readonly number[] | undefined;
  sds: readonly number[] | undefined;
  unit: string;
  digits: number;
}

function Triple({ values, sds, unit, digits }: TripleProps): VNode {
  return (
    <>
      {[0, 1, 2].map((axis) => (
        <td class="number">
          <Quantity value={values?.[axis]} sd={sds?.[axis]} unit={unit} digits={digits} reason={TOO_FEW} />
        </td>
      ))}
    </>
  );
}

function VerdictMark({ verdict }: { verdict: "inside" | "warning" | "out" }): VNode {
  const shapes = { inside: "M8 3a5 5 0 1 0 0 10a5 5 0 1 0 0-10z", warning: "M8 2l6 6l-6 6l-6-6z", out: "M3 3h10v10h-10zM3 3l10 10M13 3l-10 10" };
  return (
    <svg class={`verdict verdict-${verdict}`} viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
      <path d={shapes[verdict]} />
    </svg>
  );
}
