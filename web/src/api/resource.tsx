/** Documents of the API that stay up to date: fetched once for all who use them, and again after a change. */
import { type Signal, signal } from "@preact/signals";
import type { ComponentChildren, VNode } from "preact";
import { useEffect, useMemo } from "preact/hooks";

import { connection } from "../state/connection";
import { Failure } from "../app/failure";
import { concerns, onChange } from "./changes";
import { get, ProblemError } from "./client";

export type ResourceState<T> =
  | { state: "loading" }
  | { state: "failed"; problem: ProblemError }
  /** `stale`: the newest state of the service is not known, because the last request for it failed. */
  | { state: "ready"; value: T; stale: boolean };

interface Entry {
  readonly path: string;
  readonly content: Signal<ResourceState<unknown>>;
  users: number;
  running: boolean;
  again: boolean;
}

const LOADING: ResourceState<never> = { state: "loading" };
const entries = new Map<string, Entry>();

onChange((change) => {
  for (const entry of entries.values()) if (concerns(entry.path, change)) void load(entry);
});

connection.subscribe((state) => {
  if (state === "open") for (const entry of entries.values()) if (isOld(entry)) void load(entry);
});

/** Use the document at a path; null uses nothing and stays `loading`. */
export function useResource<T>(path: string | null): ResourceState<T> {
  const entry = useMemo(() => (path === null ? null : entryOf(path)), [path]);
  useEffect(() => {
    if (entry === null) return undefined;
    entry.users += 1;
    entries.set(entry.path, entry);
    if (entry.users === 1) void load(entry);
    return () => {
      entry.users -= 1;
      if (entry.users === 0 && entries.get(entry.path) === entry) entries.delete(entry.path);
    };
  }, [entry]);
  return entry === null ? LOADING : (entry.content.value as ResourceState<T>);
}

/** Fetch the documents whose path begins so again, after a change that this page made itself. */
export function refresh(prefix: string): void {
  for (const entry of entries.values()) if (entry.path.startsWith(prefix)) void load(entry);
}

interface ResourceProps<T> {
  of: ResourceState<T>;
  /** Shown while loading; a sentence of what is awaited. */
  loading?: string;
  /** Return what is shown instead when there is nothing in the value, otherwise null. */
  empty?: (value: T) => ComponentChildren | null;
  children: (value: T, stale: boolean) => ComponentChildren;
}

/** Draw a document, or why it is not there, the same everywhere. */
export function Resource<T>({ of, loading = "Loading", empty, children }: ResourceProps<T>): VNode {
  if (of.state === "loading") return <p class="loading" role="status">{loading} …</p>;
  if (of.state === "failed") return <Failure problem={of.problem} />;
  const nothing = empty?.(of.value) ?? null;
  if (nothing !== null) return <div class="empty">{nothing}</div>;
  return <>{children(of.value, of.stale)}</>;
}

function entryOf(path: string): Entry {
  return entries.get(path) ?? { path, content: signal(LOADING), users: 0, running: false, again: false };
}

function isOld(entry: Entry): boolean {
  const content = entry.content.peek();
  return content.state === "failed" || (content.state === "ready" && content.stale);
}

async function load(entry: Entry): Promise<void> {
  if (entry.running) {
    entry.again = true;
    return;
  }
  entry.running = true;
  do {
    entry.again = false;
    entry.content.value = await loaded(entry);
  } while (entry.again);
  entry.running = false;
}

async function loaded(entry: Entry): Promise<ResourceState<unknown>> {
  try {
    return { state: "ready", value: await get<unknown>(entry.path), stale: false };
  } catch (error) {
    const problem =
      error instanceof ProblemError ? error : new ProblemError(0, "unknown", "Answer not understood", String(error));
    const before = entry.content.peek();
    const isGone = problem.status >= 400 && problem.status < 500;
    if (before.state === "ready" && !isGone) return { ...before, stale: true };
    return { state: "failed", problem };
  }
}
