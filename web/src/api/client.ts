/** Requests to the service: JSON in and out, problems as errors. */
import type { FieldError, Problem } from "./types";

/** Problem of a request: what the service said, or `no-connection` when it did not answer. */
export class ProblemError extends Error {
  constructor(
    readonly status: number,
    readonly code: string,
    readonly title: string,
    readonly detail: string,
    readonly errors: readonly FieldError[] = [],
    readonly location: string | null = null,
  ) {
    super(`${title}: ${detail}`);
    this.name = "ProblemError";
  }
}

export interface GetOptions {
  signal?: AbortSignal;
}

export type Method = "POST" | "PUT" | "DELETE";

/** Paths whose answers contain a secret: they are not stored, so that such a request cannot be sent again. */
const SECRET = /^\/v1\/(session|keys)\b/;

let whenSignedOut: () => void = () => undefined;

/** Set what happens when the service no longer knows the session. */
export function onSignedOut(action: () => void): void {
  whenSignedOut = action;
}

let pending = new AbortController();

/** Give up all requests for documents that have no answer yet. */
export function abandon(): void {
  pending.abort();
  pending = new AbortController();
}

/** Get a JSON document. */
export async function get<T>(path: string, options: GetOptions = {}): Promise<T> {
  const response = await answered(path, { signal: signalOf(options) });
  return (await response.json()) as T;
}

/** A document with the entity tag that `If-Match` needs to replace it. */
export interface Tagged<T> {
  readonly value: T;
  readonly etag: string | null;
}

/** Get a JSON document and its entity tag. */
export async function getTagged<T>(path: string, options: GetOptions = {}): Promise<Tagged<T>> {
  const response = await answered(path, { signal: signalOf(options) });
  return { value: (await response.json()) as T, etag: response.headers.get("ETag") };
}

/** Send a change and return the JSON answer; `undefined` for an answer without a body. */
export async function send<T>(
  method: Method,
  path: string,
  body?: unknown,
  headers: Readonly<Record<string, string>> = {},
): Promise<T> {
  const sent = new Headers(headers);
  if (!SECRET.test(path)) sent.set("Idempotency-Key", randomId());
  const response = await answered(path, { method, headers: sent, body: encoded(body, sent) });
  const text = await response.text();
  return (text === "" ? undefined : JSON.parse(text)) as T;
}

/** A random identifier; `crypto.randomUUID` does not exist on pages without TLS. */
export function randomId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** The problem of an answer that is not a success, whatever its body. */
export function problemOf(status: number, body: string, location: string | null = null): ProblemError {
  try {
    const problem = JSON.parse(body) as Problem;
    const code = problem.type.split(":").at(-1) ?? "";
    return new ProblemError(status, code, problem.title, problem.detail, problem.errors ?? [], location);
  } catch {
    const detail = "The answer is not one of this service. Check the proxy in between.";
    return new ProblemError(status, "unknown", `HTTP status ${status}`, detail, [], location);
  }
}

/** The problem of a request that got no answer. */
export function noConnection(): ProblemError {
  const detail = "The service does not answer. Check the network; this page tries again by itself.";
  return new ProblemError(0, "no-connection", "No connection", detail);
}

function signalOf({ signal }: GetOptions): AbortSignal {
  return signal === undefined ? pending.signal : AbortSignal.any([pending.signal, signal]);
}

function encoded(body: unknown, headers: Headers): BodyInit | null {
  if (body === undefined) return null;
  if (body instanceof FormData || typeof body === "string") return body;
  headers.set("Content-Type", "application/json");
  return JSON.stringify(body);
}

async function answered(path: string, init: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, { credentials: "same-origin", ...init });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw noConnection();
  }
  if (response.ok) return response;
  if (response.status === 401) whenSignedOut();
  throw problemOf(response.status, await response.text(), response.headers.get("Location"));
}
