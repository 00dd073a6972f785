/** Residuals of the image points of each shot, as enlarged vectors in both images. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { CalibrationDetail, CalibrationReport, CalibrationShot } from "../api/types";
import { fixed, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { enlargement, keyLength, plotted, pointRows, type Side } from "./residuals";

const SIDES: readonly Side[] = ["left", "right"];
const NOT_ADJUSTED = "held out: its image points were not adjusted";

/** The residuals of a calibration made from images. */
export function ResidualPanel({ calibration, report }: { calibration: CalibrationDetail; report: CalibrationReport }): VNode | null {
  const [number, setNumber] = useState(report.shots[0]?.number ?? 1);
  const [withImage, setWithImage] = useState(true);
  const shot = report.shots.find((one) => one.number === number) ?? report.shots[0];
  if (shot === undefined) return null;
  const width = calibration.rig.left.image_size_px[0] ?? 1;
  const factor = enlargement(report.shots, width);
  return (
    <section class="panel residuals" aria-labelledby="residuals-title">
      <header>
        <h2 id="residuals-title">Image residuals</h2>
        <div class="row no-print">
          <label class="row">
            <input type="checkbox" checked={withImage} onChange={(event) => setWithImage(event.currentTarget.checked)} />
            image
          </label>
          <label class="row manoeuvre">
            <span class="label">Shot</span>
            <select value={shot.number} onChange={(event) => setNumber(Number(event.currentTarget.value))}>
              {report.shots.map((one) => (
                <option value={one.number} selected={one === shot}>
                  {one.number}
                  {one.used ? "" : " (held out)"}
                </option>
              ))}
            </select>
          </label>
        </div>
      </header>
      <p class="muted small">
        {shot.used
          ? `Vectors are measured less computed coordinates, u to the right and v down, enlarged ${factor} times; the same factor for every shot. A cross is a point removed as a blunder.`
          : `Shot ${shot.number} is held out: its image points were found but not adjusted, so they have no residuals; those in object space are in the table.`}
      </p>
      <div class="residual-plots">
        {SIDES.map((side) => (
          <ResidualPlot calibration={calibration} report={report} shot={shot} side={side} factor={factor} withImage={withImage} />
        ))}
      </div>
      <details class="small">
        <summary>Points of shot {shot.number} as a table</summary>
        <PointTable report={report} shot={shot} />
      </details>
    </section>
  );
}

interface ResidualPlotProps {
  calibration: CalibrationDetail;
  report: CalibrationReport;
  shot: CalibrationShot;
  side: Side;
  factor: number;
  withImage: boolean;
}

function ResidualPlot({ calibration, report, shot, side, factor, withImage }: ResidualPlotProps): VNode {
  const [width = 1, height = 1] = calibration.rig[side].image_size_px;
  const [pixelWidth = 1, pixelHeight = 1] = calibration.rig[side].pixel_size_mm;
  const aspect = pixelHeight / pixelWidth;
  const unit = width / 100;
  const key = keyLength(factor, width);
  const rms = side === "left" ? shot.image_rms_left_px : shot.image_rms_right_px;
  const points = plotted(report, shot, side, factor);
  const path = `/v1/calibrations/${encodeURIComponent(calibration.id)}/shots/${shot.number}/images/${side}`;
  const description = `${side} image of shot ${shot.number}: ${points.length} points, RMS ${rms === null ? "not known" : `${fixed(rms, 3)} px`}; the table below has each residual.`;
  return (
    <figure>
      <svg class="residual-plot" viewBox={`0 0 ${width} ${height * aspect}`} role="img" aria-label={description}>
        {withImage && <image href={path} x={-0.5} y={-0.5 * aspect} width={width} height={height * aspect} preserveAspectRatio="none" class="residual-image" />}
        <g transform={`scale(1 ${aspect})`}>
          {points.map((point) =>
            point.removed ? (
              <path class="residual-removed" d={`M${point.u - unit} ${point.v - unit}l${2 * unit} ${2 * unit}m0 ${-2 * unit}l${-2 * unit} ${2 * unit}`} />
            ) : (
              <ellipse class="residual-point" cx={point.u} cy={point.v} rx={0.55 * unit} ry={(0.55 * unit) / aspect} />
            ),
          )}
          {points.map((point) => point.end && <line class="residual-vector" x1={point.u} y1={point.v} x2={point.end[0]} y2={point.end[1]} />)}
        </g>
        {points.map((point) => (
          <text class="residual-name" x={point.u + 1.2 * unit} y={point.v * aspect - 1.2 * unit} font-size={2.4 * unit}>
            {point.id}
          </text>
        ))}
        {shot.used && (
          <g class="residual-key">
            <rect x={2 * unit} y={height * aspect - 8 * unit} width={factor * key + 18 * unit} height={6 * unit} />
            <line class="residual-vector" x1={4 * unit} x2={4 * unit + factor * key} y1={height * aspect - 5 * unit} y2={height * aspect - 5 * unit} />
            <text class="residual-name" x={6 * unit + factor * key} y={height * aspect - 4 * unit} font-size={3 * unit}>
              {withUnit(String(key), "px")}
            </text>
          </g>
        )}
      </svg>
      <figcaption>
        {side === "left" ? "Left" : "Right"} image, RMS per coordinate <Quantity value={rms} unit="px" digits={3} reason={NOT_ADJUSTED} /> ·{" "}
        <a href={path} target="_blank" rel="noreferrer">
          open the image
        </a>
      </figcaption>
    </figure>
  );
}

function PointTable({ report, shot }: { report: CalibrationReport; shot: CalibrationShot }): VNode {
  return (
    <div class="scroll-x residual-table" tabIndex={0} role="region" aria-label={`Points of shot ${shot.number}`}>
      <table>
        <thead>
          <tr>
            <th scope="col">Point</th>
            {["left u", "left v", "right u", "right v"].map((name) => (
              <th scope="col" class="number">{name}, px</th>
            ))}
            {["X", "Y", "Z"].map((name) => (
              <th scope="col" class="number">{name}, mm</th>
            ))}
          </tr>
        </thead>
        <tbody>
          {pointRows(report, shot).map((row) => (
            <tr data-point={row.id}>
              <th scope="row">
                {row.id}
                {row.removed.length > 0 && <span class="badge badge-warning">removed {row.removed.join(", ")}</span>}
              </th>
              {[row.left, row.right].map((residual) =>
                [0, 1].map((axis) => (
                  <td class="number">
                    <Quantity value={residual?.[axis]} unit="" digits={3} reason={shot.used ? "not in this image" : NOT_ADJUSTED} />
                  </td>
                )),
              )}
              {[0, 1, 2].map((axis) => (
                <td class="number">
                  <Quantity value={row.object?.[axis]} unit="" digits={3} reason="not in both images" />
                </td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
