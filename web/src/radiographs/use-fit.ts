/** The fit of landmarks, asked for again a moment after they changed. */
import { useEffect, useState } from "preact/hooks";

import { ProblemError, send } from "../api/client";
import type { InitialRadiographs, NewRadiographFit, RadiographFit } from "../api/types";
import type { FitState } from "./fit-panel";

const DELAY_MS = 350;

/** Fit landmarks; null while they are not complete. */
export function useFit(surgeryId: string, initial: InitialRadiographs | null, stage: string | null): FitState {
  const [state, setState] = useState<FitState>({ state: "waiting" });
  const text = initial === null ? null : JSON.stringify({ initial, stage } satisfies NewRadiographFit);
  useEffect(() => {
    if (text === null) {
      setState({ state: "waiting" });
      return undefined;
    }
    let isCurrent = true;
    const timer = setTimeout(async () => {
      setState((before) => (before.state === "ready" ? before : { state: "running" }));
      try {
        const path = `/v1/surgeries/${encodeURIComponent(surgeryId)}/radiographs/fit`;
        const fit = await send<RadiographFit>("POST", path, JSON.parse(text));
        if (isCurrent) setState({ state: "ready", fit });
      } catch (error) {
        if (!(error instanceof ProblemError)) throw error;
        if (isCurrent) setState({ state: "failed", problem: error });
      }
    }, DELAY_MS);
    return () => {
      isCurrent = false;
      clearTimeout(timer);
    };
  }, [surgeryId, text]);
  return state;
}
