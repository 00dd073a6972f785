/** A small plot of a few lines. */
import type { VNode } from "preact";

import { fixed } from "../format/numbers";
import { pathOf, placed, scaleOf, tickDigits } from "./plot";

export interface Line {
  readonly name: string;
  readonly values: readonly (number | null)[];
  /** Number of the colour and dash. */
  readonly style: 1 | 2 | 3 | 4;
  readonly design: "A" | "B";
}

interface PlotProps {
  title: string;
  unit: string;
  xLabel: string;
  xs: Readonly<Record<"A" | "B", readonly number[]>>;
  lines: readonly Line[];
}

const WIDTH = 360;
const HEIGHT = 210;
const LEFT = 46;
const RIGHT = 10;
const TOP = 10;
const BOTTOM = 38;

/** Lines over a common axis; the table beside it has the same numbers. */
export function LinePlot({ title, unit, xLabel, xs, lines }: PlotProps): VNode {
  const numbers = lines.flatMap(({ values }) => values.map((value) => value ?? Number.NaN));
  const xScale = scaleOf([...xs.A, ...xs.B], 4, true);
  const yScale = scaleOf(numbers);
  const x = (value: number): number => placed(xScale, value, LEFT, WIDTH - RIGHT);
  const y = (value: number): number => placed(yScale, value, HEIGHT - BOTTOM, TOP);
  return (
    <figure class="line-plot">
      <figcaption>{title}</figcaption>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={`${title}, ${unit}, over ${xLabel}; the table has the numbers`}>
        {yScale.ticks.map((tick) => (
          <g class="plot-tick">
            <line x1={LEFT} x2={WIDTH - RIGHT} y1={y(tick)} y2={y(tick)} />
            <text x={LEFT - 6} y={y(tick)} class="plot-y">{fixed(tick, tickDigits(yScale))}</text>
          </g>
        ))}
        {xScale.ticks.map((tick) => (
          <text x={x(tick)} y={HEIGHT - BOTTOM + 16} class="plot-x">{fixed(tick, tickDigits(xScale))}</text>
        ))}
        <text x={(LEFT + WIDTH - RIGHT) / 2} y={HEIGHT - 5} class="plot-x">{xLabel}</text>
        {lines.map(({ name, values, style, design }) => (
          <path
            key={`${design} ${name}`}
            class={`plot-line plot-line-${style} plot-design-${design}`}
            d={pathOf(values.map((value, index) => ({ x: x(xs[design][index] ?? Number.NaN), y: y(value ?? Number.NaN) })))}
          />
        ))}
      </svg>
      <ul class="plot-key small">
        {lines.map(({ name, style, design }) => (
          <li key={`${design} ${name}`}>
            <svg width="28" height="8" aria-hidden="true"><path class={`plot-line plot-line-${style} plot-design-${design}`} d="M0 4h28" /></svg>
            {name}
          </li>
        ))}
      </ul>
    </figure>
  );
}
