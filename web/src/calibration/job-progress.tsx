/** A calibration job: its steps, then the calibration or why there is none. */
import type { VNode } from "preact";
import { useEffect } from "preact/hooks";

import { Resource, refresh, useResource } from "../api/resource";
import type { Job } from "../api/types";
import { href, paths } from "../app/route";
import { STATE_TEXT } from "./job-text";

/** The events of a job come when it begins and ends; its steps in between are asked for. */
const EVERY_MS = 1000;

/** Follow a job. */
export function JobProgress({ id }: { id: string }): VNode {
  const path = `/v1/jobs/${encodeURIComponent(id)}`;
  const job = useResource<Job>(path);
  const state = job.state === "ready" ? job.value.state : null;
  const active = state === "queued" || state === "running";
  useEffect(() => {
    if (!active) {
      if (state === "succeeded") refresh("/v1/calibrations");
      return undefined;
    }
    const timer = setInterval(() => refresh(path), EVERY_MS);
    return () => clearInterval(timer);
  }, [active, path]);
  return (
    <Resource of={job} loading="Waiting for the job">
      {(value) => <Shown job={value} />}
    </Resource>
  );
}

function Shown({ job }: { job: Job }): VNode {
  if (job.state === "succeeded" && job.calibration_id !== null) {
    return (
      <p class="notice notice-good" role="status">
        <a href={href(paths.calibration(job.calibration_id))}>Show the calibration</a>
      </p>
    );
  }
  if (job.state === "failed" || job.state === "cancelled") {
    return (
      <div class="failure" role="alert">
        <strong>{STATE_TEXT[job.state]}</strong>
        <p>{job.error === null ? "The job ended without a calibration." : `${job.error.title}: ${job.error.detail}`}</p>
      </div>
    );
  }
  return (
    <div class="row" role="status">
      <progress value={job.progress} max={1} aria-label="Progress of the calibration" />
      <span class="small">
        {STATE_TEXT[job.state]}
        {job.step !== null && `: ${job.step}`}
      </span>
    </div>
  );
}
