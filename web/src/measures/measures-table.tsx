/** The measures as a table: one row for each measure, one column for each stage. */
import type { VNode } from "preact";

import { unitSymbol } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { StatusMark } from "../format/status-mark";
import type { SeriesGroup } from "./series";

interface MeasuresTableProps {
  groups: readonly SeriesGroup[];
  stages: readonly string[];
  stage: string | null;
}

/** All values with their 95% intervals. */
export function MeasuresTable({ groups, stages, stage }: MeasuresTableProps): VNode {
  return (
    <div class="scroll-x" tabIndex={0} role="region" aria-label="Measures by stage">
      <table class="measures-table">
        <caption>Value and 95% interval by stage; a dash has its reason.</caption>
        <thead>
          <tr>
            <th scope="col">Measure</th>
            <th scope="col">Curve</th>
            <th scope="col">Unit</th>
            {stages.map((name) => (
              <th scope="col" class="number" aria-current={name === stage ? "true" : undefined}>
                {name}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {groups.flatMap((group) =>
            group.series.map((series) => (
              <tr data-measure={series.key}>
                <th scope="row">{series.name}</th>
                <td>{series.curve ?? "whole spine"}</td>
                <td>{unitSymbol(series.unit)}</td>
                {series.points.map((point) => (
                  <td class="number" data-stage={point.stage}>
                    <StatusMark status={point.status} />{" "}
                    <Quantity value={point.value} unit={series.unit} interval={[point.low, point.high]} reason={point.reason} />
                  </td>
                ))}
              </tr>
            )),
          )}
        </tbody>
      </table>
    </div>
  );
}
