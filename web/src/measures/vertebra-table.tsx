/** One row for each vertebra: the same numbers as the 3D view, for reading, sorting and copying. */
import type { VNode } from "preact";
import { useMemo, useState } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { Flag, Motion, StageSpine, SummaryStage, SurgerySummary } from "../api/types";
import { SeverityMark } from "../format/flag-list";
import { flagName, ranked, severity } from "../format/flags";
import { unitSymbol } from "../format/numbers";
import { Quantity } from "../format/quantity";
import { StatusMark } from "../format/status-mark";
import { selectedVertebra } from "../state/selection";
import { CopyButton } from "./copy-button";
import "./measures.css";
import { tsv } from "./table-text";
import { ANATOMICAL, type Column, COLUMNS, nextSorting, rowsWithoutMotion, type Sorting, type SortKey, sorted, vertebraRows, type VertebraRow, vertebraTable } from "./vertebrae";

interface VertebraTableProps {
  surgeryId: string;
  /** The stage; the last one with a spine otherwise. */
  stage?: string | null;
  /** The earlier stage that motion is counted from; the baseline otherwise. */
  since?: string | null;
}

/** The vertebrae of a stage. */
export function VertebraTable({ surgeryId, stage = null, since = null }: VertebraTableProps): VNode {
  const summary = useResource<SurgerySummary>(`/v1/surgeries/${encodeURIComponent(surgeryId)}/summary`);
  return (
    <section class="panel vertebrae" aria-labelledby="vertebrae-title">
      <Resource
        of={summary}
        loading="Loading the vertebrae"
        empty={(value) => {
          const reason = reasonWithout(value.stages, stage);
          return reason === null ? null : (
            <>
              <h2 id="vertebrae-title">Vertebrae</h2>
              <p>{reason}</p>
            </>
          );
        }}
      >
        {(value) => <Chosen key={`${stage} ${since}`} summary={value} stage={stage} since={since} />}
      </Resource>
    </section>
  );
}

interface ChosenProps {
  summary: SurgerySummary;
  stage: string | null;
  since: string | null;
}

function Chosen({ summary, stage, since }: ChosenProps): VNode | null {
  const shown = shownStage(summary.stages, stage);
  const spine = shown?.spine ?? null;
  const [chosen, setChosen] = useState<string | null>(since);
  if (shown === undefined || spine === null) return null;
  const at = summary.stages.indexOf(shown);
  const earlier = summary.stages.slice(0, at).filter((one) => one.spine !== null).map((one) => one.name);
  const from = chosen !== null && earlier.includes(chosen) ? chosen : earlier.includes(spine.baseline.name) ? spine.baseline.name : earlier.at(-1) ?? null;
  const flags = [...spine.flags, ...(shown.flags ?? [])];
  const choice = earlier.length > 0 && (
    <label class="row manoeuvre no-print">
      <span class="label">Since</span>
      <select value={from ?? ""} onChange={(event) => setChosen(event.currentTarget.value)}>
        {earlier.map((name) => (
          <option value={name} selected={name === from}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
  const common = { spine, from, choice };
  if (from === null) {
    const reason = `${spine.stage} is the first stage with a spine: nothing has moved since an earlier one`;
    return <Table {...common} rows={rowsWithoutMotion(spine, reason, flags)} />;
  }
  const known = [spine.since_baseline, spine.since_previous].find((change) => change?.since.name === from);
  if (known) return <Table {...common} rows={vertebraRows(spine, known.vertebrae, flags)} />;
  return <Between surgeryId={summary.surgery_id} {...common} from={from} flags={flags} />;
}

interface BetweenProps extends Omit<TableProps, "rows"> {
  surgeryId: string;
  from: string;
  flags: readonly Flag[];
}

/** Motion between two stages that the summary does not have. */
function Between({ surgeryId, flags, ...common }: BetweenProps): VNode {
  const query = new URLSearchParams({ from: common.from, to: common.spine.stage });
  const motion = useResource<Motion>(`/v1/surgeries/${encodeURIComponent(surgeryId)}/motion?${query}`);
  return (
    <Resource of={motion} loading="Loading the motion">
      {({ bodies, bodies_reason: reason }) => (
        <Table {...common} rows={bodies ? vertebraRows(common.spine, bodies.vertebrae, flags) : rowsWithoutMotion(common.spine, reason ?? "no motion", flags)} />
      )}
    </Resource>
  );
}

interface TableProps {
  spine: StageSpine;
  from: string | null;
  rows: readonly VertebraRow[];
  choice: VNode | false;
}

function Table({ spine, from, rows, choice }: TableProps): VNode {
  const [sorting, setSorting] = useState<Sorting>(ANATOMICAL);
  const shown = useMemo(() => sorted(rows, sorting), [rows, sorting]);
  const copied = (): string => {
    const table = vertebraTable(shown);
    return tsv(table.header, table.rows);
  };
  const header = { sorting, onSort: (key: SortKey) => setSorting(nextSorting(sorting, key)) };
  return (
    <>
      <header>
        <h2 id="vertebrae-title">
          Vertebrae at {spine.stage}
          {from !== null && ` since ${from}`}
        </h2>
        <div class="row">
          <CopyButton text={copied} />
          {choice}
        </div>
      </header>
      <div class="scroll-x" tabIndex={0} role="region" aria-label="Vertebrae">
        <table class="vertebra-table">
          <caption>
            Motion {from === null ? "since an earlier stage" : `from ${from} to ${spine.stage}`}, value ± standard deviation. Frame:{" "}
            {spine.frame}. Derotation is about the vertebra's own z axis. Press a vertebra to select it in the 3D view.
          </caption>
          <thead>
            <tr>
              <SortHeader {...header} of="vertebra" name="Vertebra" />
              <SortHeader {...header} of="status" name="Status" />
              {COLUMNS.map((column) => (
                <SortHeader {...header} of={column.key} name={column.name} column={column} />
              ))}
              <SortHeader {...header} of="flags" name="Flags" />
            </tr>
          </thead>
          <tbody>
            {shown.map((row) => (
              <Row key={row.vertebra} row={row} />
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

interface SortHeaderProps {
  of: SortKey;
  name: string;
  column?: Column;
  sorting: Sorting;
  onSort: (key: SortKey) => void;
}

function SortHeader({ of, name, column, sorting, onSort }: SortHeaderProps): VNode {
  const active = sorting.key === of;
  const direction = sorting.descending ? "descending" : "ascending";
  return (
    <th scope="col" class={column ? "number" : undefined} aria-sort={active ? direction : "none"}>
      <button type="button" class="sort-button" onClick={() => onSort(of)}>
        {name}
        <span aria-hidden="true" class="sort-arrow">
          {active ? (sorting.descending ? "▾" : "▴") : ""}
        </span>
      </button>
      {column && (
        <span class="sort-unit muted">
          {unitSymbol(column.unit)}, + {column.positive}
        </span>
      )}
    </th>
  );
}

function Row({ row }: { row: VertebraRow }): VNode {
  const isSelected = selectedVertebra.value === row.vertebra;
  const toggle = (): void => {
    selectedVertebra.value = isSelected ? null : row.vertebra;
  };
  return (
    <tr class={isSelected ? "selected" : undefined} data-vertebra={row.vertebra} onClick={toggle}>
      <th scope="row">
        <button
          type="button"
          class="vertebra-button"
          aria-pressed={isSelected}
          onClick={(event) => {
            event.stopPropagation();
            toggle();
          }}
        >
          {row.vertebra}
        </button>
      </th>
      <td>
        <StatusMark status={row.status} named />
        <span class="vertebra-note muted small">{noteOf(row)}</span>
      </td>
      {COLUMNS.map(({ key, unit }) => (
        <td class="number" data-column={key}>
          <Quantity {...row.values[key]} unit={unit} reason={row.reason} change />
        </td>
      ))}
      <td>
        <ul class="vertebra-flags">
          {ranked(row.flags).map((flag) => (
            <li title={flag.detail}>
              <SeverityMark of={severity(flag.code)} size={14} /> {flagName(flag.code)}
              <span class="visually-hidden">: {flag.detail}</span>
            </li>
          ))}
        </ul>
      </td>
    </tr>
  );
}

/** What is to be known of a row besides its status. */
function noteOf(row: VertebraRow): string {
  if (row.isReference) return "reference, at rest";
  if (row.marked) return "own marker";
  return row.status === "not_measured" ? "" : "no marker at this stage";
}

function shownStage(stages: readonly SummaryStage[], stage: string | null): SummaryStage | undefined {
  return stage === null ? stages.findLast((one) => one.spine !== null) : stages.find((one) => one.name === stage);
}

/** Why there is no table; null when there is one. */
function reasonWithout(stages: readonly SummaryStage[], stage: string | null): string | null {
  const shown = shownStage(stages, stage);
  if (shown === undefined) return stage === null ? "No stage has a spine yet." : `There is no stage ${stage}.`;
  return shown.spine === null ? `${shown.name}: ${shown.spine_reason ?? "there is no spine yet"}` : null;
}
