/** The measures of a surgery over its stages, as small plots or as a table. */
import type { VNode } from "preact";
import { useMemo, useState } from "preact/hooks";

import { Resource, type ResourceState, useResource } from "../api/resource";
import type { MeasureDefinition, MeasureDefinitions, StageSpine, SummaryStage, SurgerySummary } from "../api/types";
import { apexAndSide } from "../format/curve";
import { STATUS, type Status } from "../format/status";
import { StatusMark } from "../format/status-mark";
import { CopyButton } from "./copy-button";
import { MeasureCard } from "./measure-card";
import { MeasuresTable } from "./measures-table";
import "./measures.css";
import { hasValues, scaleRanges, type SeriesGroup, seriesGroups, seriesTable } from "./series";
import { tsv } from "./table-text";

interface MeasuresPanelProps {
  surgeryId: string;
  /** The stage that is marked; the last one with a value otherwise. */
  stage?: string | null;
}

const STATUSES: readonly Status[] = ["measured", "assumed", "bracketed", "not_measured"];

/** All measures over the stages. */
export function MeasuresPanel({ surgeryId, stage = null }: MeasuresPanelProps): VNode {
  const summary = useResource<SurgerySummary>(`/v1/surgeries/${encodeURIComponent(surgeryId)}/summary`);
  const definitions = useResource<MeasureDefinitions>("/v1/measure-definitions");
  return (
    <section class="panel measures" aria-labelledby="measures-title">
      <Resource
        of={both(summary, definitions)}
        loading="Loading the measures"
        empty={([loaded]) => (spineOf(loaded.stages) === null ? <NoMeasures summary={loaded} /> : null)}
      >
        {([loaded, defined]) => <Measures stages={loaded.stages} definitions={defined.items} stage={stage} />}
      </Resource>
    </section>
  );
}

interface MeasuresProps {
  stages: readonly SummaryStage[];
  definitions: readonly MeasureDefinition[];
  stage: string | null;
}

function Measures({ stages, definitions, stage }: MeasuresProps): VNode {
  const [asTable, setAsTable] = useState(false);
  const groups = useMemo(() => seriesGroups(stages, definitions), [stages, definitions]);
  const series = groups.flatMap((group) => group.series);
  const ranges = useMemo(() => scaleRanges(series), [groups]);
  const spine = spineOf(stages);
  const copied = (): string => {
    const table = seriesTable(series);
    return tsv(table.header, table.rows);
  };
  return (
    <>
      <header>
        <h2 id="measures-title">Measures over the stages</h2>
        <div class="row">
          <CopyButton text={copied} />
          <div class="button-group no-print" role="group" aria-label="Form of the measures">
            <button type="button" class="button button-small" aria-pressed={!asTable} onClick={() => setAsTable(false)}>
              Plots
            </button>
            <button type="button" class="button button-small" aria-pressed={asTable} onClick={() => setAsTable(true)}>
              Table
            </button>
          </div>
        </div>
      </header>
      <p class="muted small">
        Frame: {spine?.frame}. Bars are 95% intervals; the dash and the shape say how far a value is determined:{" "}
        {STATUSES.map((status) => (
          <span class="measures-key">
            <StatusMark status={status} named />
            {status === "bracketed" && " (a vertebra is interpolated)"}
          </span>
        ))}
      </p>
      {asTable ? (
        <MeasuresTable groups={groups} stages={stages.map((one) => one.name)} stage={stage} />
      ) : (
        groups.map((group) => (
          <section class="measures-group" aria-label={groupName(group)}>
            <h3>{groupName(group)}</h3>
            <div class="measures-cards">
              {[...group.series].sort((one, other) => Number(hasValues(other)) - Number(hasValues(one))).map((one) => (
                <MeasureCard
                  key={one.key}
                  series={one}
                  range={ranges.get(one.key) ?? [-1, 1]}
                  stage={stage}
                  definition={definitions.find((definition) => definition.id === one.definition) ?? null}
                />
              ))}
            </div>
          </section>
        ))
      )}
    </>
  );
}

/** Name of a group: the curve with its vertebrae, or the whole spine. */
export function groupName({ curve }: SeriesGroup): string {
  if (curve === null) return "Whole spine";
  const open = curve.open_ends.length > 0 ? `; may go on beyond ${curve.open_ends.join(" and ")}` : "";
  return `${curve.name.charAt(0).toUpperCase()}${curve.name.slice(1)}: ${curve.upper} to ${curve.lower}, ${apexAndSide(curve)}${open}`;
}

function NoMeasures({ summary }: { summary: SurgerySummary }): VNode {
  const reasons = [...new Set(summary.stages.map((stage) => stage.spine_reason).filter((reason) => reason !== null))];
  return (
    <>
      <h2 id="measures-title">Measures over the stages</h2>
      <p>{summary.stages.length === 0 ? "No stage yet." : `${STATUS.not_measured.label}: ${reasons.join("; ") || "no spine yet"}`}</p>
      {summary.setup === null && <p>Measures need a setup of the spine: patient axes and the initial configuration.</p>}
    </>
  );
}

function spineOf(stages: readonly SummaryStage[]): StageSpine | null {
  return stages.findLast((stage) => stage.spine !== null)?.spine ?? null;
}

/** Two documents as one: loading until both are there. */
export function both<A, B>(one: ResourceState<A>, other: ResourceState<B>): ResourceState<[A, B]> {
  if (one.state === "failed") return one;
  if (other.state === "failed") return other;
  if (one.state === "loading" || other.state === "loading") return { state: "loading" };
  return { state: "ready", value: [one.value, other.value], stale: one.stale || other.stale };
}
