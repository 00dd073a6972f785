/** Accuracy of reconstructed control points per axis, against limits. */
import type { VNode } from "preact";

import type { CalibrationReport } from "../api/types";
import { fixed, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { decades, logarithmic, type Range } from "../measures/scales";
import { type AccuracyKind, type AccuracyRow, accuracyRange, accuracyRows, AXES, type AxisLimits, axisLimits, KIND_TEXT } from "./accuracy";

const WIDTH = 460;
const LANE = 18;
const SHAPES: Readonly<Record<AccuracyKind, string>> = {
  used: "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z",
  "held-out": "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z",
  "leave-one-out": "M0-6l6 6l-6 6l-6-6z",
};

/** The accuracy of a calibration made from images. */
export function AccuracyPanel({ report }: { report: CalibrationReport }): VNode {
  const rows = accuracyRows(report);
  const limits = AXES.map((_, axis) => axisLimits(report, axis));
  const range = accuracyRange(rows, limits);
  const image = report.limits?.rms_px ?? null;
  return (
    <section class="panel accuracy" aria-labelledby="accuracy-title">
      <header>
        <h2 id="accuracy-title">Accuracy of control points</h2>
      </header>
      <p class="muted small">
        Standard deviation of reconstructed less control points, object space, mm (scale of powers of ten). The rigid motion of the board
        is removed from every shot but the first.
      </p>
      <ul class="accuracy-key small" aria-label="Marks">
        {(Object.keys(SHAPES) as AccuracyKind[]).map((kind) => (
          <li>
            <svg viewBox="-8 -8 16 16" width="14" height="14" aria-hidden="true">
              <path d={SHAPES[kind]} class={`accuracy-${kind}`} />
            </svg>{" "}
            {kind}: {KIND_TEXT[kind]}
          </li>
        ))}
      </ul>
      <div class="accuracy-plots" aria-hidden="true">
        {AXES.map((name, axis) => (
          <div class="accuracy-axis">
            <strong>{name}</strong>
            <AxisPlot rows={rows} axis={axis} limits={limits[axis] ?? null} range={range} />
          </div>
        ))}
      </div>
      <div class="scroll-x" tabIndex={0} role="region" aria-label="Accuracy by shot">
        <table class="accuracy-table">
          <caption>Standard deviation (and mean) of the residuals in mm; image RMS per coordinate in px</caption>
          <thead>
            <tr>
              <th scope="col">Shot</th>
              <th scope="col">Kind</th>
              <th scope="col" class="number">Points</th>
              {AXES.map((name) => (
                <th scope="col" class="number">{name}, mm</th>
              ))}
              <th scope="col" class="number">Left, px</th>
              <th scope="col" class="number">Right, px</th>
            </tr>
          </thead>
          <tbody>
            {rows.map((row) => (
              <tr data-shot={row.name}>
                <th scope="row">{row.name}</th>
                <td>{row.kind}</td>
                <td class="number">{row.points}</td>
                {AXES.map((_, axis) => (
                  <td class="number">
                    <Quantity value={row.sd[axis]} unit="" digits={3} reason="too few points" />{" "}
                    <span class="muted small">({fixed(row.mean[axis], 3)})</span>
                  </td>
                ))}
                {[0, 1].map((side) => (
                  <td class="number">
                    <Quantity value={row.rms[side]} unit="" digits={3} reason={row.kind === "used" ? "not determined" : "its image points were not adjusted"} />
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
          <tfoot>
            <LimitRow name="flagged above" limits={limits} of={(limit) => limit.flagged} image={image} />
            <LimitRow name="refused above" limits={limits} of={(limit) => limit.refused} image={null} />
            <LimitRow name="cart of 1995 (Table 3.4), for comparison" limits={limits} of={(limit) => limit.reference} image={null} />
          </tfoot>
        </table>
      </div>
      <p class="muted small">The limits of flags and refusals are on the RMS over all axes. Nothing is flagged by the comparison with 1995.</p>
    </section>
  );
}

interface LimitRowProps {
  name: string;
  limits: readonly (AxisLimits | null)[];
  of: (limits: AxisLimits) => number;
  image: number | null;
}

function LimitRow({ name, limits, of, image }: LimitRowProps): VNode {
  const reason = "reports of earlier versions have no limits";
  return (
    <tr class="muted">
      <th scope="row" colSpan={3}>{name}</th>
      {limits.map((limit) => (
        <td class="number"><Quantity value={limit === null ? null : of(limit)} unit="" digits={2} reason={reason} /></td>
      ))}
      {[0, 1].map(() => (
        <td class="number"><Quantity value={image} unit="" digits={2} reason="no such limit" /></td>
      ))}
    </tr>
  );
}

interface AxisPlotProps {
  rows: readonly AccuracyRow[];
  axis: number;
  limits: AxisLimits | null;
  range: Range;
}

function AxisPlot({ rows, axis, limits, range }: AxisPlotProps): VNode {
  const x = logarithmic(range, [28, WIDTH - 28]);
  const height = rows.length * LANE + 52;
  const bottom = rows.length * LANE + 30;
  const marks = limits === null ? [] : ([["reference", limits.reference, "1995"], ["flagged", limits.flagged, "flagged"], ["refused", limits.refused, "refused"]] as const);
  return (
    <svg viewBox={`0 0 ${WIDTH} ${height}`} class="accuracy-plot">
      {decades(range).map((value) => (
        <>
          <line class="accuracy-grid" x1={x(value)} x2={x(value)} y1={28} y2={bottom} />
          <text x={x(value)} y={height - 8} text-anchor="middle">{withUnit(String(value), "mm")}</text>
        </>
      ))}
      {marks.map(([kind, value, label]) => (
        <>
          <line class={`accuracy-limit accuracy-limit-${kind}`} x1={x(value)} x2={x(value)} y1={28} y2={bottom} />
          <text class="accuracy-label" x={x(value)} y={kind === "reference" ? 24 : 11} text-anchor="middle">{label}</text>
        </>
      ))}
      {rows.map((row, lane) => {
        const sd = row.sd[axis] ?? null;
        return sd === null ? null : <path class={`accuracy-${row.kind}`} transform={`translate(${x(sd)} ${38 + lane * LANE})`} d={SHAPES[row.kind]} />;
      })}
    </svg>
  );
}
