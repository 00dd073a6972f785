/** Changes with their parts: a table whose first column draws them as bars. */
import type { VNode } from "preact";
import { useId } from "preact/hooks";

import type { Share } from "../api/types";
import { fixed, unitSymbol, withUnit } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { StatusMark } from "../format/status-mark";
import { type AttributionRow, barRange } from "./attribution";
import { linear, type Range, tickDigits, ticks } from "./scales";

const WIDTH = 360;
const LANE = 14;
const HEIGHT = 3 * LANE + 6;
const AXIS_HEIGHT = 20;

interface AttributionTableProps {
  title: string;
  unit: string;
  rows: readonly AttributionRow[];
}

/** The rows of one unit, on one scale. */
export function AttributionTable({ title, unit, rows }: AttributionTableProps): VNode {
  const hatch = useId();
  const range = barRange(rows);
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label={title}>
      <table class="attribution-table">
        <caption>
          {title}, {unitSymbol(unit)}
        </caption>
        <thead>
          <tr>
            <th scope="col">Of</th>
            <th scope="col" class="attribution-bars">
              <Axis range={range} unit={unit} />
            </th>
            <th scope="col" class="number">Total</th>
            <th scope="col" class="number">With rotation</th>
            <th scope="col" class="number">With distraction</th>
            <th scope="col" class="number">Remainder</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <tr data-subject={row.key}>
              <th scope="row">
                {row.quantity === "apical-translation" ? `${row.subject}, apex` : row.subject} <StatusMark status={row.status} />
              </th>
              <td class="attribution-bars">
                <Bars row={row} range={range} hatch={hatch} />
              </td>
              {(["total", "rotation", "distraction", "remainder"] as const).map((part) => (
                <td class="number" data-part={part}>
                  <ShareText share={row[part]} unit={unit} reason={row.reason} />
                </td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function ShareText({ share, unit, reason }: { share: Share; unit: string; reason: string | null }): VNode {
  return <Quantity value={share.value} sd={share.sd} unit={unit} reason={reason} change />;
}

function Axis({ range, unit }: { range: Range; unit: string }): VNode {
  const x = linear(range, [0, WIDTH]);
  const found = ticks(range, 5);
  const digits = tickDigits(found);
  return (
    <>
      <span class="visually-hidden">Bars</span>
      <svg width={WIDTH} height={AXIS_HEIGHT} aria-hidden="true">
        {found.map((value) => (
          <>
            <text x={x(value)} y={AXIS_HEIGHT - 6} text-anchor={anchor(x(value))}>
              {value === 0 ? withUnit("0", unit) : fixed(value, digits)}
            </text>
            <line x1={x(value)} x2={x(value)} y1={AXIS_HEIGHT - 3} y2={AXIS_HEIGHT} />
          </>
        ))}
      </svg>
    </>
  );
}

function Bars({ row, range, hatch }: { row: AttributionRow; range: Range; hatch: string }): VNode {
  const x = linear(range, [0, WIDTH]);
  return (
    <svg width={WIDTH} height={HEIGHT} aria-hidden="true">
      <defs>
        <pattern id={hatch} width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
          <rect width="6" height="6" class="attribution-hatch-ground" />
          <rect width="3" height="6" class="attribution-hatch-line" />
        </pattern>
      </defs>
      {ticks(range, 5).map((value) => (
        <line class={value === 0 ? "attribution-zero" : "attribution-grid"} x1={x(value)} x2={x(value)} y1={0} y2={HEIGHT} />
      ))}
      <Bar share={row.total} lane={0} x={x} kind="total" />
      <Bar share={row.rotation} lane={1} x={x} kind="rotation" />
      <Bar share={row.distraction} lane={2} x={x} kind="distraction" fill={`url(#${hatch})`} />
    </svg>
  );
}

interface BarProps {
  share: Share;
  lane: number;
  x: (value: number) => number;
  kind: "total" | "rotation" | "distraction";
  fill?: string;
}

function Bar({ share, lane, x, kind, fill }: BarProps): VNode | null {
  if (share.value === null) return null;
  const top = 3 + lane * LANE;
  const middle = top + (LANE - 3) / 2;
  const [start, end] = [Math.min(x(0), x(share.value)), Math.max(x(0), x(share.value))];
  const [low, high] = share.interval ?? [];
  return (
    <g class={`attribution-bar attribution-bar-${kind}`}>
      <rect x={start} y={top} width={Math.max(1, end - start)} height={LANE - 3} fill={fill} />
      {typeof low === "number" && typeof high === "number" && (
        <path class="attribution-interval" d={`M${x(low)} ${middle}H${x(high)}M${x(low)} ${top + 1}v${LANE - 5}M${x(high)} ${top + 1}v${LANE - 5}`} />
      )}
    </g>
  );
}

function anchor(x: number): "start" | "middle" | "end" {
  if (x < 12) return "start";
  return x > WIDTH - 12 ? "end" : "middle";
}
