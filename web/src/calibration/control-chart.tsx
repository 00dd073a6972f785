/** One quantity of the drift over the stages: centre line, limits of each stage, and what is out of control by shape. */
import type { VNode } from "preact";
import { useMemo } from "preact/hooks";
import uPlot from "uplot";

import { fixed, withUnit } from "../format/numbers";
import { axisStyle, Plot } from "../measures/plot";
import { rangeOf, shownLabels, symmetric, tickDigits, ticks } from "../measures/scales";
import { colour } from "../measures/shapes";
import { chartText, type ControlPoint, type ControlQuantity, limitsOf, type Verdict } from "./control";

const HEIGHT = 170;
const LABEL_WIDTH_PX = 60;

interface ControlChartProps {
  quantity: ControlQuantity;
  /** Oldest first. */
  points: readonly ControlPoint[];
}

/** Draw a control chart. */
export function ControlChart({ quantity, points }: ControlChartProps): VNode {
  const data = useMemo((): uPlot.AlignedData => [points.map((_, i) => i), points.map((point) => point.value)], [points]);
  return (
    <Plot
      description={chartText(quantity, points)}
      height={HEIGHT}
      data={data}
      version={JSON.stringify([quantity.key, points.map(({ value, sd, verdict }) => [value, sd, verdict])])}
      options={() => optionsOf(quantity, points)}
    />
  );
}

function optionsOf(quantity: ControlQuantity, points: readonly ControlPoint[]): Omit<uPlot.Options, "width" | "height"> {
  const n = points.length;
  const ends = points.flatMap(({ value, sd }) => [value, sd === null ? null : limitsOf(sd).action]);
  const [least = 0] = rangeOf(ends, 0, 1e-9).map(Math.abs);
  const range = symmetric(ends, 0.08, Math.max(1e-6, least * 1e-3));
  const found = ticks(range, 4);
  const digits = tickDigits(found);
  return {
    legend: { show: false },
    cursor: { show: false },
    padding: [8, 8, 0, 0],
    scales: { x: { time: false, range: [-0.5, n - 0.5] }, y: { range: [range[0], range[1]] } },
    axes: [
      {
        ...axisStyle(),
        grid: { show: false },
        size: 28,
        splits: () => points.map((_, i) => i),
        values: (plot) => {
          const shown = shownLabels(n, Math.floor(plot.width / LABEL_WIDTH_PX));
          return points.map(({ check }, i) => (shown.has(i) ? check.stage.slice(0, 8) : null));
        },
      },
      { ...axisStyle(), grid: { show: false }, size: 60, splits: () => found, values: () => found.map((value) => withUnit(fixed(value, digits), quantity.unit)) },
    ],
    series: [{}, { stroke: () => colour("--muted"), width: 1, points: { show: false }, spanGaps: false }],
    hooks: { drawClear: [(plot) => drawLimits(plot, points)], draw: [(plot) => drawPoints(plot, points)] },
  };
}

function drawLimits(plot: uPlot, points: readonly ControlPoint[]): void {
  const { ctx, bbox } = plot;
  const ratio = uPlot.pxRatio;
  ctx.save();
  points.forEach(({ sd }, i) => {
    if (sd === null) return;
    const { warning, action } = limitsOf(sd);
    const [left, right] = [plot.valToPos(i - 0.5, "x", true), plot.valToPos(i + 0.5, "x", true)];
    const [top, bottom] = [plot.valToPos(warning, "y", true), plot.valToPos(-warning, "y", true)];
    ctx.fillStyle = colour("--raised");
    ctx.fillRect(left, top, right - left, bottom - top);
    ctx.strokeStyle = colour("--warning");
    ctx.lineWidth = 1.5 * ratio;
    ctx.setLineDash([4 * ratio, 3 * ratio]);
    for (const limit of [warning, -warning]) horizontal(ctx, left, right, plot.valToPos(limit, "y", true));
    ctx.strokeStyle = colour("--error");
    ctx.setLineDash([]);
    for (const limit of [action, -action]) horizontal(ctx, left, right, plot.valToPos(limit, "y", true));
  });
  ctx.strokeStyle = colour("--control-line");
  ctx.lineWidth = 1.5 * ratio;
  horizontal(ctx, bbox.left, bbox.left + bbox.width, plot.valToPos(0, "y", true));
  ctx.restore();
}

function drawPoints(plot: uPlot, points: readonly ControlPoint[]): void {
  const { ctx } = plot;
  const ratio = uPlot.pxRatio;
  ctx.save();
  points.forEach(({ value, verdict }, i) => {
    if (value !== null) drawVerdict(ctx, verdict, plot.valToPos(i, "x", true), plot.valToPos(value, "y", true), 4.5 * ratio);
  });
  ctx.restore();
}

/** A disc within the limits, an open diamond between them, a cross in a square beyond. */
function drawVerdict(ctx: CanvasRenderingContext2D, verdict: Verdict, x: number, y: number, r: number): void {
  const path = new Path2D();
  ctx.setLineDash([]);
  ctx.lineWidth = r * 0.4;
  if (verdict === "inside") {
    path.arc(x, y, r, 0, 2 * Math.PI);
    ctx.fillStyle = colour("--accent");
    ctx.fill(path);
    return;
  }
  if (verdict === "warning") {
    for (const [dx, dy] of [[0, -1.4], [1.4, 0], [0, 1.4], [-1.4, 0]] as const) path.lineTo(x + dx * r, y + dy * r);
    path.closePath();
  } else {
    path.rect(x - r * 1.2, y - r * 1.2, 2.4 * r, 2.4 * r);
    path.moveTo(x - r * 1.2, y - r * 1.2);
    path.lineTo(x + r * 1.2, y + r * 1.2);
    path.moveTo(x + r * 1.2, y - r * 1.2);
    path.lineTo(x - r * 1.2, y + r * 1.2);
  }
  ctx.fillStyle = colour("--surface");
  ctx.strokeStyle = colour(verdict === "warning" ? "--warning" : "--error");
  ctx.fill(path);
  ctx.stroke(path);
}

function horizontal(ctx: CanvasRenderingContext2D, left: number, right: number, y: number): void {
  ctx.beginPath();
  ctx.moveTo(left, y);
  ctx.lineTo(right, y);
  ctx.stroke();
}
