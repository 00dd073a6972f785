/** Stages on their way to the service; they go on while other pages are shown. */
import { signal } from "@preact/signals";

import { ProblemError, randomId } from "../api/client";
import { refresh } from "../api/resource";
import { type Draft, formOf } from "./draft";
import type { ChosenFile } from "./files";
import { type Transfer, transfer } from "./transfer";

export interface Upload {
  readonly id: string;
  readonly surgeryId: string;
  readonly name: string;
  readonly state: "sending" | "sent" | "failed";
  /** Fraction of the bytes that are sent, 0 to 1. */
  readonly sent: number;
  readonly bytes: number;
  readonly problem: ProblemError | null;
}

export const uploads = signal<readonly Upload[]>([]);

const running = new Map<string, Transfer>();
const forms = new Map<string, FormData>();

/** Send a stage; resolves when the service has stored it, or when that failed. */
export async function sendStage(surgeryId: string, draft: Draft<ChosenFile>, retake: boolean): Promise<boolean> {
  const id = randomId();
  const bytes = draft.files.reduce((sum, { content }) => sum + content.size, 0);
  forms.set(id, formOf(draft, retake));
  uploads.value = [
    { id, surgeryId, name: draft.name, state: "sending", sent: 0, bytes, problem: null },
    ...uploads.value.filter((upload) => upload.state !== "sent"),
  ];
  return attempt(id, surgeryId);
}

/** Send a stage again whose transfer failed; the service stores it once. */
export async function sendAgain(upload: Upload): Promise<boolean> {
  update(upload.id, { state: "sending", sent: 0, problem: null });
  return attempt(upload.id, upload.surgeryId);
}

/** Give up a stage that is on its way, or forget one that is not. */
export function discard(id: string): void {
  running.get(id)?.abort();
  forms.delete(id);
  uploads.value = uploads.value.filter((upload) => upload.id !== id);
}

async function attempt(id: string, surgeryId: string): Promise<boolean> {
  const form = forms.get(id);
  if (form === undefined) return false;
  const path = `/v1/surgeries/${encodeURIComponent(surgeryId)}/stages`;
  const sending = transfer(path, form, id, (sent, total) => update(id, { sent: total > 0 ? sent / total : 0 }));
  running.set(id, sending);
  try {
    await sending.answer;
    forms.delete(id);
    update(id, { state: "sent", sent: 1 });
    refresh(`/v1/surgeries/${encodeURIComponent(surgeryId)}`);
    return true;
  } catch (error) {
    if (!(error instanceof ProblemError)) throw error;
    update(id, { state: "failed", problem: error });
    return false;
  } finally {
    running.delete(id);
  }
}

function update(id: string, values: Partial<Upload>): void {
  uploads.value = uploads.value.map((upload) => (upload.id === id ? { ...upload, ...values } : upload));
}
