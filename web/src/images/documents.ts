/** The documents of the page: the takes of a stage, and what was measured in one pair of one take. */
import { type ResourceState, useResource } from "../api/resource";
import type { CalibrationDetail, Stage, StageCandidates, StageFeatures, StagePage, StageTriads, Surgery } from "../api/types";

export interface StageDocuments {
  surgery: Surgery;
  /** Every take, the latest first. */
  takes: Stage[];
  /** The take whose results count; null while none was measured. */
  counted: Stage | null;
}

export interface TakeDocuments {
  triads: StageTriads;
  features: StageFeatures;
  candidates: StageCandidates;
  calibration: CalibrationDetail;
}

/** The path of a stage in the API. */
export function stagePath(surgeryId: string, stage: string): string {
  return `/v1/surgeries/${encodeURIComponent(surgeryId)}/stages/${encodeURIComponent(stage)}`;
}

/** The number of pairs of a take. */
export function pairsOf(take: Stage): number {
  return take.pairs ?? 1;
}

/** The surgery and the takes of a stage; up to date by themselves. */
export function useStage(surgeryId: string, stage: string): ResourceState<StageDocuments> {
  const surgery = useResource<Surgery>(`/v1/surgeries/${encodeURIComponent(surgeryId)}`);
  const takes = useResource<StagePage>(`${stagePath(surgeryId, stage)}/takes?limit=200`);
  return joined({ surgery, takes }, (ready) => ({
    surgery: ready.surgery,
    takes: ready.takes.items,
    counted: ready.takes.items.find((take) => take.state === "succeeded") ?? null,
  }));
}

/** What was measured in a pair of a measured take; null asks for nothing. */
export function useTake(take: Stage | null, pair: number): ResourceState<TakeDocuments> {
  const base = take === null ? null : stagePath(take.surgery_id, take.name);
  const path = (part: string, query: string): string | null => (base === null ? null : `${base}/${part}?${query}`);
  const byTake = `take=${take?.take ?? 0}`;
  const triads = useResource<StageTriads>(path("triads", byTake));
  const features = useResource<StageFeatures>(path("features", `${byTake}&pair=${pair}`));
  const candidates = useResource<StageCandidates>(path("candidates", `${byTake}&pair=${pair}`));
  const calibration = useResource<CalibrationDetail>(
    take === null ? null : `/v1/calibrations/${encodeURIComponent(take.calibration_id)}`,
  );
  return joined({ triads, features, candidates, calibration }, (ready) => ready);
}

type States<T> = { [K in keyof T]: ResourceState<T[K]> };

/** One state of several documents: loading until all are there, failed when one is. */
export function joined<T extends object, R>(states: States<T>, value: (ready: T) => R): ResourceState<R> {
  const all = Object.entries(states) as [keyof T, ResourceState<T[keyof T]>][];
  const ready = {} as T;
  let stale = false;
  let loading = false;
  for (const [name, state] of all) {
    if (state.state === "failed") return state;
    if (state.state === "loading") loading = true;
    else {
      ready[name] = state.value;
      stale ||= state.stale;
    }
  }
  return loading ? { state: "loading" } : { state: "ready", value: value(ready), stale };
}
