/** The state of a job by word, shape and colour. */
import type { VNode } from "preact";

import type { JobState } from "../api/types";

const LOOKS: Readonly<Record<JobState, { label: string; look: string; path: string }>> = {
  queued: { label: "waiting", look: "badge", path: "M5 1a4 4 0 1 0 .01 0M5 3v2.2l1.5 1" },
  running: { label: "measuring", look: "badge badge-info", path: "M5 1a4 4 0 1 1-4 4" },
  succeeded: { label: "measured", look: "badge badge-good", path: "M1 5.5l2.8 3l5-6.5" },
  failed: { label: "failed", look: "badge badge-error", path: "M1 1l8 8M9 1l-8 8" },
  cancelled: { label: "cancelled", look: "badge", path: "M1 5h8" },
};

/** A badge with the state of a job. */
export function StateMark({ state }: { state: JobState }): VNode {
  const { label, look, path } = LOOKS[state];
  return (
    <span class={look}>
      <svg class={`state-${state}`} viewBox="0 0 10 10" width="10" height="10" aria-hidden="true">
        <path d={path} fill="none" stroke="currentColor" stroke-width="1.8" stroke-linecap="round" />
      </svg>
      {label}
    </span>
  );
}
