/** What the glance panel shows: the newest values of the major curve, and whether they are the newest there are. */
import type { Curve, Flag, MeasureValue, StageSpine, SummaryStage, SurgerySummary } from "../api/types";
import { flagsOf, type StageGroup } from "../timeline/stages";

export interface Glance {
  /** The stage whose values are shown; null while there is none. */
  readonly stage: SummaryStage | null;
  /** The curve with the largest Cobb angle at the baseline. */
  readonly curve: Curve | null;
  /** Name of the baseline stage. */
  readonly baseline: string | null;
  readonly cobb: MeasureValue | null;
  readonly cobbChange: MeasureValue | null;
  readonly rotation: MeasureValue | null;
  readonly rotationChange: MeasureValue | null;
  /** Flags of the stage whose values are shown, or of the newest one while there are no values. */
  readonly flags: readonly Flag[];
  /** The stage that was sent last. */
  readonly newest: StageGroup | null;
  /** Why the values are not those of the newest stage, or why there are none; null when they are. */
  readonly behind: string | null;
}

/** What to show of a surgery. */
export function glanceOf(summary: SurgerySummary, groups: readonly StageGroup[]): Glance {
  const newest = newestOf(groups);
  const stage = summary.stages.findLast(({ spine }) => spine !== null) ?? null;
  const spine = stage?.spine ?? null;
  const curve = spine === null ? null : majorCurve(baselineSpine(summary, spine), spine);
  const flagged = groups.find(({ name }) => name === stage?.name) ?? newest;
  const change = spine?.since_baseline?.measures ?? [];
  return {
    stage,
    curve,
    baseline: spine?.baseline.name ?? null,
    cobb: measure(spine?.measures ?? [], "cobb-fixed", curve),
    cobbChange: measure(change, "cobb-fixed", curve),
    rotation: measure(spine?.measures ?? [], "apical-rotation", curve),
    rotationChange: measure(change, "apical-rotation", curve),
    flags: flagged === null ? [] : flagsOf(flagged, summary),
    newest,
    behind: behind(summary, newest, stage),
  };
}

/** The curve with the largest Cobb angle at the baseline; the first of several equal ones. */
function majorCurve(baseline: StageSpine, spine: StageSpine): Curve | null {
  const size = (curve: Curve): number => Math.abs(measure(baseline.measures, "cobb-fixed", curve)?.value ?? 0);
  return spine.curves.reduce<Curve | null>(
    (major, curve) => (major === null || size(curve) > size(major) ? curve : major),
    null,
  );
}

function baselineSpine(summary: SurgerySummary, spine: StageSpine): StageSpine {
  return summary.stages.find(({ name }) => name === spine.baseline.name)?.spine ?? spine;
}

function measure(measures: readonly MeasureValue[], definition: string, curve: Curve | null): MeasureValue | null {
  if (curve === null) return null;
  return measures.find((value) => value.definition === definition && value.curve === curve.name) ?? null;
}

function newestOf(groups: readonly StageGroup[]): StageGroup | null {
  return groups.reduce<StageGroup | null>(
    (newest, group) => (newest === null || group.latest.created_at >= newest.latest.created_at ? group : newest),
    null,
  );
}

function behind(summary: SurgerySummary, newest: StageGroup | null, shown: SummaryStage | null): string | null {
  if (newest === null) return "No stage yet.";
  const { name, latest } = newest;
  if (latest.state === "queued") return `${name} waits to be measured.`;
  if (latest.state === "running") return `${name} is being measured.`;
  if (latest.state === "failed") return `${name} failed: ${latest.job.error?.detail ?? "no reason is known"}`;
  if (latest.state === "cancelled" && newest.counted === latest) return `${name} was cancelled.`;
  if (shown?.name === name) return null;
  const reason = summary.stages.find((stage) => stage.name === name)?.spine_reason;
  return reason == null ? null : `${name}: ${reason}.`;
}
