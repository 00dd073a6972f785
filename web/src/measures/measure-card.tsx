/** One measure: its value at a stage, its plot and its definition. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import type { MeasureDefinition } from "../api/types";
import { digitsFor, unitSymbol } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { StatusMark } from "../format/status-mark";
import type { Range } from "./scales";
import { hasValues, type MeasurePoint, type MeasureSeries, pointAt } from "./series";
import { StagePlot } from "./stage-plot";

interface MeasureCardProps {
  series: MeasureSeries;
  range: Range;
  stage: string | null;
  definition: MeasureDefinition | null;
}

/** A small plot with its numbers. */
export function MeasureCard({ series, range, stage, definition }: MeasureCardProps): VNode {
  const [hovered, setHovered] = useState<string | null>(null);
  const point = pointAt(series, hovered ?? stage);
  return (
    <article class="measure-card" data-measure={series.key}>
      <h4>{series.name}</h4>
      {point !== undefined && <PointLine point={point} unit={series.unit} />}
      {hasValues(series) ? (
        <StagePlot series={series} range={range} stage={stage ?? point?.stage ?? null} onHover={setHovered} />
      ) : (
        <p class="measure-none muted small">No stage has a value. {point?.reason ?? ""}</p>
      )}
      <p class="muted small">
        {unitSymbol(series.unit) === "°" ? "degrees" : series.unit}; positive: {definition?.sign ?? "as defined"}
      </p>
      {definition !== null && (
        <details class="small">
          <summary>Definition</summary>
          <p>
            <code>{definition.formula}</code>
          </p>
          <p class="muted">{definition.reference}</p>
        </details>
      )}
    </article>
  );
}

function PointLine({ point, unit }: { point: MeasurePoint; unit: string }): VNode {
  return (
    <p class="measure-point">
      <span class="measure-stage muted small">{point.stage}</span>
      <span class="measure-value">
        <Quantity value={point.value} sd={point.sd} unit={unit} reason={point.reason} digits={Math.max(1, digitsFor(point.sd))} />
      </span>
      <StatusMark status={point.status} />
      {point.levels !== "" && <span class="muted small">{point.levels}</span>}
    </p>
  );
}
