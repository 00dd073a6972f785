/** The setup of a spine as it is stored: read with its entity tag, replaced only when it is still the same. */
import { useEffect, useState } from "preact/hooks";

import { onChange } from "../api/changes";
import { getTagged, ProblemError, send, type Tagged } from "../api/client";
import { refresh } from "../api/resource";
import type { SpineSetup, StoredSpineSetup } from "../api/types";

export type StoredState =
  | { readonly state: "loading" }
  | { readonly state: "failed"; readonly problem: ProblemError }
  /** `stored` is null while the surgery has no setup. */
  | { readonly state: "ready"; readonly stored: Tagged<StoredSpineSetup> | null };

export type SaveOutcome =
  | { readonly outcome: "saved" }
  /** Somebody else stored a setup meanwhile: `theirs`. */
  | { readonly outcome: "conflict"; readonly theirs: Tagged<StoredSpineSetup> }
  | { readonly outcome: "refused"; readonly problem: ProblemError };

const MISSING = "spine-setup-missing";

/** Path of the setup of a surgery. */
export function setupPath(surgeryId: string): string {
  return `/v1/surgeries/${encodeURIComponent(surgeryId)}/spine`;
}

/** The setup of a surgery; null when it has none. */
export async function loadSetup(surgeryId: string): Promise<Tagged<StoredSpineSetup> | null> {
  try {
    return await getTagged<StoredSpineSetup>(setupPath(surgeryId));
  } catch (error) {
    if (error instanceof ProblemError && error.code === MISSING) return null;
    throw error;
  }
}

/** Store a setup in the place of the one that was read; null for the first one. */
export async function saveSetup(
  surgeryId: string,
  setup: SpineSetup,
  replaced: Tagged<StoredSpineSetup> | null,
): Promise<SaveOutcome> {
  const headers: Record<string, string> = replaced?.etag == null ? {} : { "If-Match": replaced.etag };
  try {
    await send<StoredSpineSetup>("PUT", setupPath(surgeryId), setup, headers);
    refresh(`/v1/surgeries/${encodeURIComponent(surgeryId)}`);
    return { outcome: "saved" };
  } catch (error) {
    if (!(error instanceof ProblemError)) throw error;
    if (error.status !== 412 && error.status !== 428) return { outcome: "refused", problem: error };
    const theirs = await loadSetup(surgeryId);
    return theirs === null ? { outcome: "refused", problem: error } : { outcome: "conflict", theirs };
  }
}

/** The stored setup, and how to read it again; `changed` tells that somebody stored another one meanwhile. */
export function useStoredSetup(surgeryId: string): { stored: StoredState; changed: boolean; reload: () => Promise<void> } {
  const [stored, setStored] = useState<StoredState>({ state: "loading" });
  const [changed, setChanged] = useState(false);
  const reload = async (): Promise<void> => {
    try {
      setStored({ state: "ready", stored: await loadSetup(surgeryId) });
      setChanged(false);
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      setStored({ state: "failed", problem: error });
    }
  };
  useEffect(() => {
    void reload();
    return onChange((change) => {
      if (change.surgery_id === surgeryId && change.action === "spine:configured") setChanged(true);
    });
  }, [surgeryId]);
  return { stored, changed, reload };
}
