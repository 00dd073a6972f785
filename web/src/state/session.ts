/** Who uses the page, and what the key permits. */
import { computed, effect, signal } from "@preact/signals";

import { abandon, get, onSignedOut, ProblemError, send } from "../api/client";
import type { Identity, Scope } from "../api/types";

export type Session = { state: "unknown" } | { state: "out"; problem: ProblemError | null } | { state: "in"; identity: Identity };

export const session = signal<Session>({ state: "unknown" });

/** Whether somebody is signed in. */
export const signedIn = computed(() => session.value.state === "in");

/** Whether the key of the session has a scope; `admin` includes the others. */
export function permits(scope: Scope): boolean {
  const now = session.value;
  return now.state === "in" && (now.identity.scopes.includes(scope) || now.identity.scopes.includes("admin"));
}

const NAME = "spinewatch-signed-in";

/**
 * Find out whether the browser has a session already. Only the service can read its cookie, and it writes down requests
 * that it refuses: so it is asked only where a session was started before.
 */
export async function resume(): Promise<void> {
  if (!startedBefore()) {
    session.value = { state: "out", problem: null };
    return;
  }
  try {
    session.value = { state: "in", identity: await get<Identity>("/v1/session") };
  } catch (error) {
    const unknown = error instanceof ProblemError && error.status !== 401 ? error : null;
    session.value = { state: "out", problem: unknown };
  }
}

/** Start a session with an API key; the key itself is not kept. */
export async function signIn(key: string): Promise<void> {
  try {
    const identity = await send<Identity>("POST", "/v1/session", undefined, { Authorization: `Bearer ${key.trim()}` });
    session.value = { state: "in", identity };
  } catch (error) {
    session.value = { state: "out", problem: error instanceof ProblemError ? error : null };
  }
}

/** End the session. */
export async function signOut(): Promise<void> {
  // first of all nothing asks the service any more: it would have to refuse
  session.value = { state: "unknown" };
  abandon();
  try {
    await send<undefined>("DELETE", "/v1/session");
    session.value = { state: "out", problem: null };
  } catch (error) {
    if (!(error instanceof ProblemError)) throw error;
    session.value = { state: "out", problem: error.status === 401 ? null : error };
  }
}

onSignedOut(() => {
  if (session.peek().state === "in") session.value = { state: "out", problem: null };
});

effect(() => {
  const { state } = session.value;
  try {
    if (state === "in") localStorage.setItem(NAME, "yes");
    if (state === "out") localStorage.removeItem(NAME);
  } catch {
    // a browser without storage asks for the key each time
  }
});

function startedBefore(): boolean {
  try {
    return localStorage.getItem(NAME) !== null;
  } catch {
    return false;
  }
}
