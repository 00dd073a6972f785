/** How much of each correction came with rotation and how much with distraction. */
import type { VNode } from "preact";
import { useMemo, useState } from "preact/hooks";

import { Resource, useResource } from "../api/resource";
import type { SummaryStage, SurgerySummary } from "../api/types";
import { AttributionTable } from "./attribution-table";
import { type AttributionRow, attributionRows, defaultManoeuvre, type Manoeuvre, manoeuvres, reasonsOf } from "./attribution";
import { CopyButton } from "./copy-button";
import "./measures.css";
import { tsv } from "./table-text";

interface AttributionPanelProps {
  surgeryId: string;
  /** The stage whose manoeuvre is shown first; the last one otherwise. */
  stage?: string | null;
}

/** The attribution of each manoeuvre. */
export function AttributionPanel({ surgeryId, stage = null }: AttributionPanelProps): VNode {
  const summary = useResource<SurgerySummary>(`/v1/surgeries/${encodeURIComponent(surgeryId)}/summary`);
  return (
    <section class="panel attribution" aria-labelledby="attribution-title">
      <Resource
        of={summary}
        loading="Loading the attribution"
        empty={(value) =>
          manoeuvres(value.stages).length === 0 ? (
            <>
              <h2 id="attribution-title">Rotation and distraction</h2>
              <p>Two stages with a spine are needed for a manoeuvre.</p>
            </>
          ) : null
        }
      >
        {(value) => <Shown key={stage} stages={value.stages} stage={stage} />}
      </Resource>
    </section>
  );
}

function Shown({ stages, stage }: { stages: readonly SummaryStage[]; stage: string | null }): VNode | null {
  const all = useMemo(() => manoeuvres(stages), [stages]);
  const [chosen, setChosen] = useState<string | null>(null);
  const manoeuvre = all.find((one) => one.key === chosen) ?? defaultManoeuvre(all, stage);
  if (manoeuvre === undefined) return null;
  const rows = attributionRows(manoeuvre.change.attribution);
  return (
    <>
      <header>
        <h2 id="attribution-title">Rotation and distraction</h2>
        <div class="row">
          <CopyButton text={() => copied(manoeuvre, [...rows.curves, ...rows.displacements, ...rows.missing])} />
          <ManoeuvreChoice all={all} chosen={manoeuvre} onChoose={setChosen} />
        </div>
      </header>
      <p class="muted small">
        Changes from {manoeuvre.from} to {manoeuvre.to}, and what came together with rotation and with distraction, not which
        force caused it. Rotation, distraction and remainder add up to the total. Lines are 95% intervals. Cobb angle: positive is
        more convex to the right. Lateral displacement: positive is to the right.
      </p>
      <ul class="attribution-key small" aria-label="Bars">
        <li class="attribution-total">total</li>
        <li class="attribution-rotation">with rotation</li>
        <li class="attribution-distraction">with distraction</li>
      </ul>
      {rows.curves.length > 0 && <AttributionTable title="Cobb angle of each curve" unit="deg" rows={rows.curves} />}
      {rows.displacements.length > 0 && (
        <AttributionTable title="Lateral displacement of each apex and vertebra" unit="mm" rows={rows.displacements} />
      )}
      {rows.missing.length > 0 && <Missing rows={rows.missing} />}
    </>
  );
}

interface ManoeuvreChoiceProps {
  all: readonly Manoeuvre[];
  chosen: Manoeuvre;
  onChoose: (key: string) => void;
}

function ManoeuvreChoice({ all, chosen, onChoose }: ManoeuvreChoiceProps): VNode {
  const option = (one: Manoeuvre): VNode => (
    <option value={one.key} selected={one.key === chosen.key}>
      {one.from} → {one.to}
    </option>
  );
  const whole = all.filter((one) => one.sinceBaseline);
  return (
    <label class="row manoeuvre no-print">
      <span class="label">Manoeuvre</span>
      <select value={chosen.key} onChange={(event) => onChoose(event.currentTarget.value)}>
        <optgroup label="since the stage before">{all.filter((one) => !one.sinceBaseline).map(option)}</optgroup>
        {whole.length > 0 && <optgroup label="since the baseline">{whole.map(option)}</optgroup>}
      </select>
    </label>
  );
}

function Missing({ rows }: { rows: readonly AttributionRow[] }): VNode {
  return (
    <details class="small">
      <summary>Without an attribution: {rows.map((row) => row.subject).join(", ")}</summary>
      <ul class="attribution-missing">
        {reasonsOf(rows).map(({ reason, subjects }) => (
          <li>
            <strong>{subjects.join(", ")}</strong>: {reason}
          </li>
        ))}
      </ul>
    </details>
  );
}

function copied({ from, to }: Manoeuvre, rows: readonly AttributionRow[]): string {
  const parts = ["total", "rotation", "distraction", "remainder"] as const;
  const header = ["from", "to", "subject", "quantity", "levels", ...parts.flatMap((part) => [part, `${part}_sd`, `${part}_low_95`, `${part}_high_95`]), "status", "reason"];
  const cells = rows.map((row) => [
    from,
    to,
    row.subject,
    row.quantity,
    row.levels,
    ...parts.flatMap((part) => [row[part].value, row[part].sd, row[part].interval?.[0], row[part].interval?.[1]]),
    row.status,
    row.reason,
  ]);
  return tsv(header, cells);
}
