/** How old a calibration is. */
import type { Calibration } from "../api/types";
import { age, duration } from "../format/time";

/** Return the age as text; from the time of storage it is a lower bound. */
export function ageText({ calibrated_at: calibrated, created_at: created }: Pick<Calibration, "calibrated_at" | "created_at">, nowMs: number): string {
  const seconds = age(calibrated ?? created, nowMs);
  if (seconds === null) return "unknown";
  const text = duration(Math.max(0, seconds));
  return calibrated === null ? `at least ${text}` : text;
}
