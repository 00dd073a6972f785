/** The plan of a design, asked for a moment after it changed. */
import { useEffect, useState } from "preact/hooks";

import { get, ProblemError } from "../api/client";
import type { AccuracyPlan, DisparityPlan } from "../api/types";

const DELAY_MS = 250;

export type PlanState =
  | { readonly state: "none" }
  | { readonly state: "failed"; readonly problem: ProblemError }
  | { readonly state: "ready"; readonly accuracy: AccuracyPlan; readonly disparity: DisparityPlan; readonly stale: boolean };

/** Plan with two queries; null plans nothing. */
export function usePlan(accuracyQuery: string | null, disparityQuery: string | null): PlanState {
  const [state, setState] = useState<PlanState>({ state: "none" });
  useEffect(() => {
    if (accuracyQuery === null || disparityQuery === null) {
      setState({ state: "none" });
      return undefined;
    }
    setState((before) => (before.state === "ready" ? { ...before, stale: true } : before));
    const abort = new AbortController();
    const timer = setTimeout(async () => {
      try {
        const [accuracy, disparity] = await Promise.all([
          get<AccuracyPlan>(`/v1/plans/accuracy?${accuracyQuery}`, { signal: abort.signal }),
          get<DisparityPlan>(`/v1/plans/disparity?${disparityQuery}`, { signal: abort.signal }),
        ]);
        setState({ state: "ready", accuracy, disparity, stale: false });
      } catch (error) {
        if (abort.signal.aborted) return;
        if (!(error instanceof ProblemError)) throw error;
        setState({ state: "failed", problem: error });
      }
    }, DELAY_MS);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [accuracyQuery, disparityQuery]);
  return state;
}
