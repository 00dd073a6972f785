/** States of a calibration job in words. */
import type { JobState } from "../api/types";

export const STATE_TEXT: Readonly<Record<JobState, string>> = {
  queued: "waiting for a worker",
  running: "calibrating",
  succeeded: "calibrated",
  failed: "Not calibrated",
  cancelled: "Cancelled",
};
