/** Measures over the stages of a surgery, as series for plots and tables. */
import { fixed, interval as intervalText, unitSymbol, withUnit } from "../format/numbers";
import { STATUS, type Status } from "../format/status";
import type { Curve, MeasureDefinition, MeasureValue, SummaryStage } from "../api/types";
import { type Range, rangeOf } from "./scales";

export interface MeasurePoint {
  readonly stage: string;
  readonly value: number | null;
  readonly sd: number | null;
  readonly low: number | null;
  readonly high: number | null;
  readonly status: Status;
  /** Vertebrae that it is measured between, such as `T8–L1`. */
  readonly levels: string;
  readonly reason: string | null;
}

export interface MeasureSeries {
  readonly key: string;
  readonly definition: string;
  readonly curve: string | null;
  readonly unit: string;
  readonly name: string;
  /** One for each stage, in order. */
  readonly points: readonly MeasurePoint[];
}

export interface SeriesGroup {
  /** Curve that the series belong to; null for the whole spine. */
  readonly curve: Curve | null;
  readonly series: readonly MeasureSeries[];
}

/** Definitions that share one scale, so that their plots can be compared. */
const SHARED_SCALES: readonly (readonly string[])[] = [
  ["cobb-fixed", "cobb-reselected"],
  ["apical-rotation", "apical-rotation-projected"],
];

const NOTHING: Pick<MeasurePoint, "value" | "sd" | "low" | "high"> = { value: null, sd: null, low: null, high: null };

/** Return what a measure is shown as: no value, bracketed, assumed or measured, the first that applies. */
export function shownStatus(measure: Pick<MeasureValue, "status" | "assumed">): Status {
  if (measure.status !== "measured") return measure.status;
  return measure.assumed ? "assumed" : "measured";
}

/** Return the levels of a measure as text. */
export function levelsText(levels: readonly string[]): string {
  return levels.join("\u2013");
}

/** Return the series of a surgery: those of each curve, cranial first, then those of the whole spine. */
export function seriesGroups(
  stages: readonly SummaryStage[],
  definitions: readonly MeasureDefinition[],
): SeriesGroup[] {
  const byKey = new Map<string, { first: MeasureValue; values: Map<number, MeasureValue> }>();
  stages.forEach((stage, index) => {
    for (const measure of stage.spine?.measures ?? []) {
      const key = keyOf(measure);
      const entry = byKey.get(key) ?? { first: measure, values: new Map<number, MeasureValue>() };
      entry.values.set(index, measure);
      byKey.set(key, entry);
    }
  });
  const names = new Map(definitions.map((definition, order) => [definition.id, { name: definition.name, order }]));
  const all = [...byKey].map(([key, { first, values }]): MeasureSeries => {
    const suffix = first.curve === null && first.levels.length > 0 ? ` ${levelsText(first.levels)}` : "";
    return {
      key,
      definition: first.definition,
      curve: first.curve,
      unit: first.unit,
      name: (names.get(first.definition)?.name ?? first.definition) + suffix,
      points: stages.map((stage, index) => pointOf(stage, values.get(index))),
    };
  });
  const order = (series: MeasureSeries): number => names.get(series.definition)?.order ?? names.size;
  all.sort((one, other) => order(one) - order(other));
  const curves = curvesOf(stages);
  const groups = curves.map((curve) => ({ curve, series: all.filter((series) => series.curve === curve.name) }));
  const rest = { curve: null, series: all.filter((series) => !curves.some((curve) => curve.name === series.curve)) };
  return [...groups, rest].filter((group) => group.series.length > 0);
}

/** Return the range of values and intervals of each series by its key; comparable series have one range. */
export function scaleRanges(series: readonly MeasureSeries[]): Map<string, Range> {
  const ranges = new Map<string, Range>();
  for (const one of series) {
    const shared = SHARED_SCALES.find((ids) => ids.includes(one.definition)) ?? [one.definition];
    const alike = series.filter((other) => other === one || (other.curve === one.curve && other.curve !== null && shared.includes(other.definition)));
    const values = alike.flatMap((other) => other.points.flatMap((point) => [point.value, point.low, point.high]));
    ranges.set(one.key, rangeOf(values));
  }
  return ranges;
}

/** Return whether any stage has a value. */
export function hasValues(series: MeasureSeries): boolean {
  return series.points.some((point) => point.value !== null);
}

/** Return the point of a stage, or else the last one with a value, or else the last one. */
export function pointAt(series: MeasureSeries, stage: string | null): MeasurePoint | undefined {
  const exact = series.points.find((point) => point.stage === stage);
  return exact ?? series.points.findLast((point) => point.value !== null) ?? series.points.at(-1);
}

/** Return a point as a sentence: what a plot shows for those who do not see it. */
export function pointText(point: MeasurePoint, unit: string): string {
  const status = STATUS[point.status].label;
  if (point.value === null) return `${point.stage}: none, ${point.reason ?? status}`;
  const ends = intervalText(point.low, point.high, unit);
  return `${point.stage}: ${withUnit(fixed(point.value), unit)}, 95% ${ends}, ${status}`;
}

/** Return a whole series as text. */
export function seriesText(series: MeasureSeries): string {
  return `${series.name} by stage. ${series.points.map((point) => pointText(point, series.unit)).join("; ")}.`;
}

/** Header and rows of a table of series, for copying: full precision, one row for each stage and measure. */
export function seriesTable(series: readonly MeasureSeries[]): { header: string[]; rows: (string | number | null)[][] } {
  const header = ["stage", "curve", "measure", "levels", "unit", "value", "sd", "low_95", "high_95", "status", "reason"];
  const rows = series.flatMap((one) =>
    one.points.map((point) => [
      point.stage,
      one.curve,
      one.definition,
      point.levels,
      unitSymbol(one.unit) === "°" ? "deg" : one.unit,
      point.value,
      point.sd,
      point.low,
      point.high,
      point.status,
      point.reason,
    ]),
  );
  return { header, rows };
}

function keyOf(measure: MeasureValue): string {
  return `${measure.definition} ${measure.curve ?? measure.levels.join("-")}`;
}

function curvesOf(stages: readonly SummaryStage[]): readonly Curve[] {
  return stages.find((stage) => stage.spine !== null)?.spine?.curves ?? [];
}

function pointOf(stage: SummaryStage, measure: MeasureValue | undefined): MeasurePoint {
  if (measure === undefined) {
    const reason = stage.spine === null ? stage.spine_reason ?? "the spine of this stage is not known" : "this stage has no such measure";
    return { stage: stage.name, ...NOTHING, status: "not_measured", levels: "", reason };
  }
  const [low = null, high = null] = measure.interval ?? [];
  return {
    stage: stage.name,
    value: measure.value,
    sd: measure.sd,
    low,
    high,
    status: shownStatus(measure),
    levels: levelsText(measure.levels),
    reason: measure.reason,
  };
}
