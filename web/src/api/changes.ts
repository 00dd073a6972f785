/** Which documents a change of the service's contents concerns. */
import type { Change } from "./types";

type Listener = (change: Change) => void;

const listeners = new Set<Listener>();

/** Call `listener` for every change that the service announces; the result ends that. */
export function onChange(listener: Listener): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Tell all listeners of a change. */
export function announce(change: Change): void {
  for (const listener of [...listeners]) listener(change);
}

/** Return whether the document at a path of the API may differ after a change. */
export function concerns(path: string, change: Change): boolean {
  const [, , collection = "", id = "", part = "", name = ""] = (path.split("?")[0] ?? "")
    .split("/")
    .map(decodeURIComponent);
  switch (collection) {
    case "surgeries":
      if (id === "") return change.kind === "surgery" || change.kind === "stage";
      if (change.surgery_id !== id) return false;
      // results of a stage change with its own takes and, through the setup and the baseline, with the spine
      return part !== "stages" || name === "" || change.kind !== "stage" || affects(change, name);
    case "calibrations":
      if (id === "") return change.kind === "calibration";
      return part === "checks" ? change.kind === "stage" : change.id === id || change.kind === "stage";
    case "jobs":
      return id === "" ? change.kind === "job" || change.kind === "stage" : change.id === id || change.kind !== "surgery";
    default:
      return false;
  }
}

function affects(change: Change, name: string): boolean {
  return change.stage === name || change.action.startsWith("stage:measured");
}
