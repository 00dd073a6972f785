/** One measure over the stages: values by the shape of their status, 95% intervals as bars with its dash. */
import type { VNode } from "preact";
import { useMemo } from "preact/hooks";
import uPlot from "uplot";

import { fixed, withUnit } from "../format/numbers";
import { STATUS } from "../format/status";
import { axisStyle, Plot } from "./plot";
import { type Range, shownLabels, tickDigits, ticks } from "./scales";
import { type MeasureSeries, seriesText } from "./series";
import { colour, drawStatus } from "./shapes";

interface StagePlotProps {
  series: MeasureSeries;
  range: Range;
  /** The stage that is marked. */
  stage: string | null;
  /** Told of the stage under the pointer, null for none. */
  onHover: (stage: string | null) => void;
}

const HEIGHT = 168;
const LABEL_WIDTH_PX = 56;

/** Draw a measure over the stages. */
export function StagePlot({ series, range, stage, onHover }: StagePlotProps): VNode {
  const data = useMemo(
    (): uPlot.AlignedData => [series.points.map((_, i) => i), series.points.map((point) => point.value)],
    [series],
  );
  const version = JSON.stringify([series, range, stage]);
  return (
    <Plot
      description={seriesText(series)}
      height={HEIGHT}
      data={data}
      version={version}
      options={() => optionsOf(series, range, stage, onHover)}
    />
  );
}

function optionsOf(
  series: MeasureSeries,
  range: Range,
  stage: string | null,
  onHover: (stage: string | null) => void,
): Omit<uPlot.Options, "width" | "height"> {
  const n = series.points.length;
  const marked = series.points.findIndex((point) => point.stage === stage);
  const found = ticks(range, 4);
  const digits = tickDigits(found);
  return {
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
    padding: [8, 8, 0, 0],
    scales: { x: { time: false, range: [-0.5, n - 0.5] }, y: { range: [range[0], range[1]] } },
    axes: [
      {
        ...axisStyle(),
        grid: { show: false },
        size: 28,
        splits: () => series.points.map((_, i) => i),
        values: (plot) => {
          const labels = shownLabels(n, Math.floor(plot.width / LABEL_WIDTH_PX), marked < 0 ? null : marked);
          return series.points.map((point, i) => (labels.has(i) ? shortened(point.stage) : null));
        },
      },
      {
        ...axisStyle(),
        size: 56,
        splits: () => found,
        values: () => found.map((value, i) => (i === found.length - 1 ? withUnit(fixed(value, digits), series.unit) : fixed(value, digits))),
      },
    ],
    series: [{}, { stroke: () => colour("--muted"), width: 1, points: { show: false }, spanGaps: false }],
    hooks: {
      drawClear: [(plot) => drawGround(plot, marked)],
      draw: [(plot) => drawPoints(plot, series)],
      setCursor: [(plot) => onHover(hovered(plot, series))],
    },
  };
}

/** The band of the marked stage and the line of zero, under everything else. */
function drawGround(plot: uPlot, marked: number): void {
  const { ctx, bbox } = plot;
  ctx.save();
  if (marked >= 0) {
    const left = plot.valToPos(marked - 0.5, "x", true);
    ctx.fillStyle = colour("--raised");
    ctx.fillRect(left, bbox.top, plot.valToPos(marked + 0.5, "x", true) - left, bbox.height);
  }
  const zero = plot.valToPos(0, "y", true);
  if (zero > bbox.top && zero < bbox.top + bbox.height) {
    ctx.strokeStyle = colour("--control-line");
    ctx.lineWidth = uPlot.pxRatio;
    ctx.beginPath();
    ctx.moveTo(bbox.left, zero);
    ctx.lineTo(bbox.left + bbox.width, zero);
    ctx.stroke();
  }
  ctx.restore();
}

function drawPoints(plot: uPlot, series: MeasureSeries): void {
  const { ctx, bbox } = plot;
  const ratio = uPlot.pxRatio;
  const crowded = bbox.width / series.points.length < 14 * ratio;
  const radius = (crowded ? 3 : 5) * ratio;
  ctx.save();
  series.points.forEach((point, i) => {
    const x = plot.valToPos(i, "x", true);
    const look = STATUS[point.status];
    if (point.value === null) {
      drawStatus(ctx, "not_measured", x, bbox.top + bbox.height - 2 * radius, radius * 0.7);
      return;
    }
    if (point.low !== null && point.high !== null) {
      const [low, high] = [plot.valToPos(point.low, "y", true), plot.valToPos(point.high, "y", true)];
      const cap = radius * 0.8;
      ctx.strokeStyle = colour(look.colour);
      ctx.lineWidth = 2 * ratio;
      ctx.setLineDash(look.dash.map((length) => (length * ratio) / 2));
      line(ctx, x, low, x, high);
      ctx.setLineDash([]);
      line(ctx, x - cap, low, x + cap, low);
      line(ctx, x - cap, high, x + cap, high);
    }
    drawStatus(ctx, point.status, x, plot.valToPos(point.value, "y", true), radius);
  });
  ctx.restore();
}

function line(ctx: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
}

function hovered(plot: uPlot, series: MeasureSeries): string | null {
  const { left, idx } = plot.cursor;
  if (left === undefined || left < 0 || idx === null || idx === undefined) return null;
  return series.points[idx]?.stage ?? null;
}

function shortened(name: string): string {
  return name.length > 8 ? `${name.slice(0, 7)}\u2026` : name;
}
