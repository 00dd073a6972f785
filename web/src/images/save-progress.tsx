/** The measurement of a correction, from the queue to its result. */
import type { VNode } from "preact";
import { useEffect } from "preact/hooks";

import { useResource } from "../api/resource";
import type { Job } from "../api/types";
import { ProblemError } from "../api/client";
import { Failure } from "../app/failure";

interface SaveProgressProps {
  job: string;
  take: number;
  /** Called once when the take is measured. */
  onDone: () => void;
  /** Called when the person has read why there is no result. */
  onClose: () => void;
}

/** A progress bar; when the job fails, why. */
export function SaveProgress({ job, take, onDone, onClose }: SaveProgressProps): VNode {
  const resource = useResource<Job>(`/v1/jobs/${encodeURIComponent(job)}`);
  const state = resource.state === "ready" ? resource.value.state : null;
  useEffect(() => {
    if (state === "succeeded") onDone();
  }, [state]);
  if (resource.state === "failed") return <Failure problem={resource.problem} />;
  const value = resource.state === "ready" ? resource.value : null;
  if (value?.state === "failed" || value?.state === "cancelled") {
    return (
      <div class="notice notice-error" role="alert">
        <strong>
          Take {take} was not measured: {value.error?.title ?? value.state}
        </strong>
        <p>{value.error?.detail ?? "The job was cancelled."} Your correction is kept here.</p>
        <div class="row">
          <button type="button" class="button" onClick={onClose}>
            Back to the correction
          </button>
        </div>
      </div>
    );
  }
  return (
    <div class="notice" role="status">
      <strong>Take {take} is being computed from your correction</strong>
      <progress max={1} value={value?.progress ?? 0} aria-label={`Progress of take ${take}`} />
      <p class="small muted">{value === null || value.state === "queued" ? "waiting for a worker" : (value.step ?? "running")}</p>
    </div>
  );
}

/** The error of anything that was thrown while saving. */
export function asProblem(error: unknown): ProblemError {
  if (error instanceof ProblemError) return error;
  return new ProblemError(0, "unknown", "Not saved", String(error));
}
