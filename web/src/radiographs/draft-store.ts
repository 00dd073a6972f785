/** Landmarks that are not stored yet, kept by the browser tab: a reload or a look at another page loses none. */
import type { Landmarks } from "./landmarks";

export interface StoredDraft {
  readonly pa: string;
  readonly lateral: string;
  readonly sdPx: number;
  readonly stage: string | null;
  readonly landmarks: Landmarks;
}

/** Keep a draft of a surgery. */
export function keepDraft(surgeryId: string, draft: StoredDraft): void {
  try {
    sessionStorage.setItem(nameOf(surgeryId), JSON.stringify(draft));
  } catch {
    // without storage the draft lives as long as the page
  }
}

/** The draft of a surgery; null without one. */
export function keptDraft(surgeryId: string): StoredDraft | null {
  try {
    const text = sessionStorage.getItem(nameOf(surgeryId));
    return text === null ? null : (JSON.parse(text) as StoredDraft);
  } catch {
    return null;
  }
}

/** Forget the draft of a surgery, once it is stored. */
export function forgetDraft(surgeryId: string): void {
  try {
    sessionStorage.removeItem(nameOf(surgeryId));
  } catch {
    // there is nothing to forget
  }
}

function nameOf(surgeryId: string): string {
  return `spinewatch-landmarks/${surgeryId}`;
}
