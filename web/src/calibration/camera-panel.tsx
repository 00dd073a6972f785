/** Parameters of both cameras, their determination, correlations, and the geometry of the rig. */
import type { VNode } from "preact";

import type { CalibrationReport, Rig } from "../api/types";
import { fixed, unitSymbol, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { parameterRows, type ParameterValue, withDigits } from "./cameras";

interface CameraPanelProps {
  rig: Rig;
  report: CalibrationReport | null;
}

/** Both cameras. */
export function CameraPanel({ rig, report }: CameraPanelProps): VNode {
  return (
    <section class="panel cameras" aria-labelledby="cameras-title">
      <header>
        <h2 id="cameras-title">Cameras</h2>
      </header>
      <div class="scroll-x" tabIndex={0} role="region" aria-label="Parameters of the cameras">
        <table>
          <caption>
            Parameters in object space, value ± standard deviation.
            {report !== null && " Below it, the deviation as a share of the limit above which a parameter counts as not determined. Held parameters were not adjusted."}
          </caption>
          <thead>
            <tr>
              <th scope="col">Parameter</th>
              <th scope="col">Unit</th>
              <th scope="col" class="number">Left</th>
              <th scope="col" class="number">Right</th>
            </tr>
          </thead>
          <tbody>
            {parameterRows(rig, report).map((row) => (
              <tr data-parameter={row.name}>
                <th scope="row">
                  {row.name} <span class="muted small">{row.meaning}</span>
                </th>
                <td>{unitSymbol(row.unit)}</td>
                <Value of={row.left} />
                <Value of={row.right} />
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

/** Correlations of the adjusted parameters. */
export function CorrelationPanel({ report }: { report: CalibrationReport }): VNode {
  const strong = [...report["correlations_above_0.9"]].sort((one, other) => Math.abs(other.correlation) - Math.abs(one.correlation));
  return (
    <section class="panel" aria-labelledby="correlations-title">
      <header>
        <h2 id="correlations-title">Correlations above 0.9</h2>
      </header>
      {strong.length === 0 ? (
        <p class="muted">None: each parameter is determined by itself.</p>
      ) : (
        <>
          <p class="muted small">Strongly correlated parameters compensate each other: each alone is less certain than the positions that follow from both.</p>
          <table>
            <thead>
              <tr>
                <th scope="col">Parameters</th>
                <th scope="col" class="number">Correlation</th>
              </tr>
            </thead>
            <tbody>
              {strong.map(({ between, correlation }) => (
                <tr>
                  <td>{between.join(" and ")}</td>
                  <td class="number">{fixed(correlation, 3)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </>
      )}
    </section>
  );
}

/** What does not depend on the choice of object space. */
export function GeometryPanel({ report }: { report: CalibrationReport }): VNode {
  const { geometry, limits } = report;
  const [near = null, far = null] = geometry.depth_of_field_mm;
  const [width, height] = geometry.field_of_view_mm;
  const [left, right] = geometry.range_mm;
  return (
    <section class="panel" aria-labelledby="geometry-title">
      <header>
        <h2 id="geometry-title">Geometry of the rig</h2>
      </header>
      <dl class="geometry">
        <dt>Baseline</dt>
        <dd>
          <Quantity value={geometry.baseline_mm} sd={geometry.baseline_sd_mm} unit="mm" digits={2} />
          {limits && <span class="muted small"> flagged above ± {withUnit(fixed(limits.baseline_sd_mm[0], 1), "mm")}</span>}
        </dd>
        <dt>Vergence</dt>
        <dd>
          <Quantity value={geometry.vergence_deg} sd={geometry.vergence_sd_deg} unit="deg" digits={2} />
        </dd>
        <dt>Range, left and right</dt>
        <dd>
          {fixed(left, 0)} and {withUnit(fixed(right, 0), "mm")}
        </dd>
        <dt>Common field of view</dt>
        <dd>
          {fixed(width, 0)} × {withUnit(fixed(height, 0), "mm")}
        </dd>
        <dt>Depth of field at f/{fixed(geometry.f_number, 1)}</dt>
        <dd>
          {fixed(near, 0)} to {far === null ? "infinity" : withUnit(fixed(far, 0), "mm")}
        </dd>
        <dt>Depth of the control points</dt>
        <dd>{withUnit(fixed(geometry.control_depth_mm, 0), "mm")}</dd>
      </dl>
      {report.angles_on_board.length > 0 && (
        <table class="geometry-sizes">
          <caption>RMS errors of distances and of angles on the board, by size</caption>
          <thead>
            <tr>
              <th scope="col" class="number">Size, mm</th>
              <th scope="col" class="number">Distance, mm</th>
              <th scope="col" class="number">Angle, °</th>
              <th scope="col" class="number">Angles</th>
            </tr>
          </thead>
          <tbody>
            {report.angles_on_board.map((entry) => (
              <tr>
                <td class="number">{fixed(entry.size_mm, 0)}</td>
                <td class="number">{fixed(entry.distance_rms_mm, 3)}</td>
                <td class="number">{fixed(entry.angle_rms_deg, 3)}</td>
                <td class="number">{entry.measurements}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

function Value({ of }: { of: ParameterValue }): VNode {
  const { value, sd } = withDigits(of.value, of.sd);
  const share = of.sd !== null && of.limit !== null ? of.sd / of.limit : null;
  return (
    <td class="number">
      {value}
      {sd !== "" && <span class="muted"> ± {sd}</span>}
      {of.held && <span class="muted small"> held</span>}
      {share !== null && <span class="determination muted small">{withUnit(fixed(100 * share, 1), "%")} of the limit</span>}
    </td>
  );
}
