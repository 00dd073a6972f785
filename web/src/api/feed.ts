/**
 * The changes of the service as they happen: a stream of server-sent events, checked by asking.
 *
 * A stream alone does not show that its connection has died, and a proxy may hold it back. So the page also asks for the
 * changes since the last one it knows: seldom while the stream is open, often while it is not.
 */
import type { Connection } from "../state/connection";
import { ProblemError } from "./client";
import type { Change, Changes } from "./types";

/** The parts of a browser's EventSource that are used. */
export interface Stream {
  onopen: ((event: Event) => unknown) | null;
  onerror: ((event: Event) => unknown) | null;
  onmessage: ((message: MessageEvent) => unknown) | null;
  readonly readyState: number;
  close(): void;
}

export interface FeedParts {
  /** Open a stream of the changes after a number. */
  open(since: number): Stream;
  /** Ask for the changes after a number; rejects when the service does not answer in time. */
  ask(since: number): Promise<Changes>;
  /** Called with each change, once, in order. */
  change(change: Change): void;
  /** Called where what happened before is not known, at the start and after a restored backup: read everything again. */
  reread(): void;
  /** Called with the state of the connection. */
  state(connection: Connection): void;
}

const OPEN = 1;
const CLOSED = 2;
/** A number after every change: the answer tells which one is the last. */
const AFTER_ALL = Number.MAX_SAFE_INTEGER;
const ASK_WHILE_OPEN_MS = 3000;
const ASK_OTHERWISE_MS = 400;

/** Follows the changes until it is stopped. */
export class Feed {
  #position: number | null = null;
  #stream: Stream | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #asking = false;
  #stopped = false;

  constructor(private readonly parts: FeedParts) {}

  /** Begin to follow; changes before the first answer are not delivered. */
  start(): void {
    this.parts.state("connecting");
    this.check();
  }

  /** Ask now, because something may have happened to the connection. */
  check(): void {
    clearTimeout(this.#timer);
    if (!this.#asking && !this.#stopped) void this.#ask();
  }

  /** Show that the connection is lost before a request has failed, and ask. */
  suspect(): void {
    this.parts.state("lost");
    this.check();
  }

  /** End to follow. */
  stop(): void {
    this.#stopped = true;
    clearTimeout(this.#timer);
    this.#stream?.close();
  }

  async #ask(): Promise<void> {
    this.#asking = true;
    try {
      const known = this.#position;
      const page = await this.parts.ask(known ?? AFTER_ALL);
      if (!this.#stopped) this.#take(known, page);
    } catch (error) {
      if (this.#stopped) return;
      if (error instanceof ProblemError && error.status === 401) {
        this.stop();
        return;
      }
      this.parts.state("lost");
    } finally {
      this.#asking = false;
    }
    if (!this.#stopped) this.#timer = setTimeout(() => this.check(), this.#pause());
  }

  #take(known: number | null, page: Changes): void {
    this.parts.state("open");
    if (known === null || page.last < known) {
      this.#position = page.last;
      this.#open(page.last);
      this.parts.reread();
      return;
    }
    let missed = false;
    for (const change of page.changes) missed = this.#deliver(change.seq, change) || missed;
    if (page.done) this.#position = Math.max(this.#position ?? 0, page.last);
    // a stream that was slower than an answer may be dead
    if (missed || this.#stream === null || this.#stream.readyState === CLOSED) this.#open(this.#position ?? 0);
  }

  #deliver(number: number, change: Change): boolean {
    if (this.#position !== null && number <= this.#position) return false;
    this.#position = number;
    this.parts.change(change);
    return true;
  }

  #open(since: number): void {
    this.#stream?.close();
    const stream = this.parts.open(since);
    this.#stream = stream;
    stream.onmessage = ({ data, lastEventId }) => {
      if (this.#stream === stream) this.#deliver(Number(lastEventId), JSON.parse(String(data)) as Change);
    };
    stream.onerror = () => this.check();
    stream.onopen = () => this.check();
  }

  #pause(): number {
    return this.#stream?.readyState === OPEN ? ASK_WHILE_OPEN_MS : ASK_OTHERWISE_MS;
  }
}
