/** The takes of a surgery, with the progress of those that are being measured. */
import { useEffect } from "preact/hooks";

import { refresh, type ResourceState, useResource } from "../api/resource";
import type { StagePage } from "../api/types";

/** Time between two looks at a measurement: events tell of its start and its end, but not of its progress. */
const LOOK_MS = 700;

/** Use the takes of a surgery: the newest two hundred. */
export function useStages(surgeryId: string): ResourceState<StagePage> {
  const path = `/v1/surgeries/${encodeURIComponent(surgeryId)}/stages?limit=200`;
  const stages = useResource<StagePage>(path);
  const active =
    stages.state === "ready" && stages.value.items.some(({ state }) => state === "queued" || state === "running");
  useEffect(() => {
    if (!active) return undefined;
    const timer = setInterval(() => refresh(path), LOOK_MS);
    return () => clearInterval(timer);
  }, [active, path]);
  return stages;
}
