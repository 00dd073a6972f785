/** How much of a change came with rotation and how much with distraction: choices, rows and bars. */
import type { Attribution, Share, SpineChange, SummaryStage } from "../api/types";
import type { Status } from "../format/status";
import { type Range, symmetric } from "./scales";
import { levelsText, shownStatus } from "./series";

/** A change between two stages. */
export interface Manoeuvre {
  readonly key: string;
  readonly from: string;
  readonly to: string;
  /** Whether the earlier stage is the baseline and not the stage before. */
  readonly sinceBaseline: boolean;
  readonly change: SpineChange;
}

export interface AttributionRow {
  readonly key: string;
  readonly subject: string;
  readonly quantity: string;
  readonly total: Share;
  readonly rotation: Share;
  readonly distraction: Share;
  readonly remainder: Share;
  readonly reason: string | null;
  /** What the change and its parts are shown as. */
  readonly status: Status;
  /** Vertebrae that the quantity is measured between. */
  readonly levels: string;
}

export interface AttributionRows {
  /** Cobb angles of the curves, degrees. */
  readonly curves: readonly AttributionRow[];
  /** Lateral displacements: of apices, then of vertebrae, cranial first, mm. */
  readonly displacements: readonly AttributionRow[];
  /** What has neither a change nor its parts. */
  readonly missing: readonly AttributionRow[];
}

/** Return the manoeuvres of a surgery in order: each stage since the one before, and where it differs since the baseline. */
export function manoeuvres(stages: readonly SummaryStage[]): Manoeuvre[] {
  return stages.flatMap((stage) => {
    const spine = stage.spine;
    if (spine === null) return [];
    const previous = made(stage.name, spine.since_previous, false);
    const baseline = made(stage.name, spine.since_baseline, true);
    const same = previous !== null && baseline !== null && previous.from === baseline.from;
    return [previous, same ? null : baseline].filter((found): found is Manoeuvre => found !== null);
  });
}

/** Return the manoeuvre that is shown first: the one that ends in a stage, or else the last one. */
export function defaultManoeuvre(all: readonly Manoeuvre[], stage: string | null): Manoeuvre | undefined {
  const steps = all.filter((one) => !one.sinceBaseline);
  return steps.find((one) => one.to === stage) ?? steps.at(-1) ?? all.at(-1);
}

/** Return the rows of a manoeuvre. */
export function attributionRows(attribution: readonly Attribution[]): AttributionRows {
  const rows = attribution.map((item): AttributionRow => ({
    ...item,
    remainder: { value: item.remainder, sd: item.remainder_sd ?? null, interval: item.remainder_interval ?? null },
    key: `${item.subject} ${item.quantity}`,
    status: statusOf(item),
    levels: levelsText(item.levels ?? []),
  }));
  const shown = rows.filter((row) => row.total.value !== null || row.rotation.value !== null);
  return {
    curves: shown.filter((row) => row.quantity === "cobb-fixed"),
    displacements: shown.filter((row) => row.quantity !== "cobb-fixed"),
    missing: rows.filter((row) => !shown.includes(row)),
  };
}

/** Return one scale for all bars of a unit, with zero in the middle. */
export function barRange(rows: readonly AttributionRow[]): Range {
  return symmetric(rows.flatMap((row) => [row.total, row.rotation, row.distraction].flatMap((share) => [share.value, ...(share.interval ?? [])])));
}

/** Return what rotation, distraction and remainder leave of the total; null where a part is not known. */
export function discrepancy(row: AttributionRow): number | null {
  const { total, rotation, distraction, remainder } = row;
  if (total.value === null || rotation.value === null || distraction.value === null || remainder.value === null) return null;
  return total.value - rotation.value - distraction.value - remainder.value;
}

/** Return reasons with the subjects that they hold for; a reason that names its subject counts once for all. */
export function reasonsOf(rows: readonly AttributionRow[]): { reason: string; subjects: string[] }[] {
  const found = new Map<string, string[]>();
  for (const row of rows) {
    const reason = (row.reason ?? "not measured").replace(new RegExp(`\\b${escaped(row.subject)}\\b`), "it");
    found.set(reason, [...(found.get(reason) ?? []), row.subject]);
  }
  return [...found].map(([reason, subjects]) => ({ reason, subjects }));
}

/** Nothing says that a change of an earlier version, which has no status, was measured. */
function statusOf({ total, status, assumed }: Attribution): Status {
  if (total.value === null) return "not_measured";
  return shownStatus({ status: status ?? "bracketed", assumed: assumed ?? false });
}

function made(to: string, change: SpineChange | null, sinceBaseline: boolean): Manoeuvre | null {
  if (change === null) return null;
  return { key: `${sinceBaseline ? "baseline" : "previous"} ${to}`, from: change.since.name, to, sinceBaseline, change };
}

function escaped(text: string): string {
  return text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
}
