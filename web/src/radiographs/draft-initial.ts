/** Digitized landmarks of this tab that are not stored yet, for the setup that is to take them. */
import type { InitialRadiographs } from "../api/types";
import { assembled, isComplete } from "./document";
import { keptDraft } from "./draft-store";

/** The landmarks of a surgery's draft; null when there are none, or too few. */
export function draftInitial(surgeryId: string): InitialRadiographs | null {
  const draft = keptDraft(surgeryId);
  if (draft === null || !isComplete(draft.landmarks)) return null;
  return assembled(draft.landmarks, { pa: draft.pa, lateral: draft.lateral }, draft.sdPx);
}
