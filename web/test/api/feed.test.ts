import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

import { ProblemError } from "../../src/api/client";
import { Feed, type Stream } from "../../src/api/feed";
import type { Change, Changes } from "../../src/api/types";

class TestStream implements Stream {
  onopen: ((event: Event) => unknown) | null = null;
  onerror: ((event: Event) => unknown) | null = null;
  onmessage: ((message: MessageEvent) => unknown) | null = null;
  readyState = 0;

  constructor(readonly since: number) {}

  open(): void {
    this.readyState = 1;
    this.onopen?.(new Event("open"));
  }

  send(change: Change): void {
    this.onmessage?.(new MessageEvent("message", { data: JSON.stringify(change), lastEventId: String(change.seq) }));
  }

  fail(state: number): void {
    this.readyState = state;
    this.onerror?.(new Event("error"));
  }

  close(): void {
    this.readyState = 2;
  }
}

function change(seq: number): Change {
  return { seq, at: "2026-11-21T09:30:00Z", kind: "stage", action: "stage:measured", id: "x", surgery_id: "s", stage: "PRE", take: 1 };
}

/** A service with the changes up to a number, which may not answer. */
class World {
  last = 5;
  answers: "yes" | "no" | "signed-out" = "yes";
  streams: TestStream[] = [];
  seen: number[] = [];
  states: string[] = [];
  readings = 0;
  readonly feed = new Feed({
    open: (since) => {
      const stream = new TestStream(since);
      this.streams.push(stream);
      return stream;
    },
    ask: (since) => this.#answer(since),
    change: ({ seq }) => this.seen.push(seq),
    reread: () => (this.readings += 1),
    state: (state) => {
      if (this.states.at(-1) !== state) this.states.push(state);
    },
  });

  get stream(): TestStream {
    const stream = this.streams.at(-1);
    if (stream === undefined) throw new Error("no stream was opened");
    return stream;
  }

  async #answer(since: number): Promise<Changes> {
    if (this.answers === "no") throw new ProblemError(0, "no-connection", "No connection", "");
    if (this.answers === "signed-out") throw new ProblemError(401, "session-ended", "Session ended", "");
    const changes = [];
    for (let seq = since + 1; seq <= this.last; seq += 1) changes.push(change(seq));
    return { changes, last: this.last, done: true };
  }
}

async function pass(milliseconds: number): Promise<void> {
  await vi.advanceTimersByTimeAsync(milliseconds);
}

describe("Feed", () => {
  let world: World;

  beforeEach(async () => {
    vi.useFakeTimers();
    world = new World();
    world.feed.start();
    await pass(0);
    world.stream.open();
    await pass(0);
  });

  afterEach(() => {
    world.feed.stop();
    vi.useRealTimers();
  });

  it("begins after the last change that there is", () => {
    expect(world.stream.since).toBe(5);
    expect(world.seen).toEqual([]);
    expect(world.states).toEqual(["connecting", "open"]);
    expect(world.readings).toBe(1);
  });

  it("delivers what the stream sends, once", async () => {
    world.last = 6;
    world.stream.send(change(6));
    world.stream.send(change(6));
    await pass(10_000);
    expect(world.seen).toEqual([6]);
    expect(world.streams).toHaveLength(1);
  });

  it("finds by asking what the stream does not deliver, and opens another one after it", async () => {
    world.last = 7;
    await pass(3000);
    expect(world.seen).toEqual([6, 7]);
    expect(world.stream.since).toBe(7);
    expect(world.streams[0]?.readyState).toBe(2);
  });

  it("asks within half a second while there is no open stream", async () => {
    world.stream.fail(0);
    await pass(0);
    world.last = 6;
    await pass(500);
    expect(world.seen).toEqual([6]);
  });

  it("shows a lost connection, and takes up where it ended when it is back", async () => {
    world.answers = "no";
    world.stream.fail(2);
    await pass(0);
    expect(world.states.at(-1)).toBe("lost");
    world.last = 8;
    await pass(60_000);
    expect(world.seen).toEqual([]);
    world.answers = "yes";
    await pass(500);
    expect(world.states.at(-1)).toBe("open");
    expect(world.seen).toEqual([6, 7, 8]);
    expect(world.stream.since).toBe(8);
  });

  it("believes the browser that says it is offline", async () => {
    world.answers = "no";
    world.feed.suspect();
    expect(world.states.at(-1)).toBe("lost");
  });

  it("ignores what an abandoned stream still sends", async () => {
    const first = world.stream;
    first.fail(2);
    await pass(500);
    expect(world.stream).not.toBe(first);
    world.last = 6;
    first.send(change(6));
    expect(world.seen).toEqual([]);
    world.stream.send(change(6));
    expect(world.seen).toEqual([6]);
  });

  it("tells when a backup was restored", async () => {
    world.last = 3;
    await pass(3000);
    expect(world.readings).toBe(2);
    expect(world.stream.since).toBe(3);
  });

  it("ends when the session has ended", async () => {
    world.answers = "signed-out";
    await pass(3000);
    world.answers = "yes";
    world.last = 9;
    await pass(10_000);
    expect(world.seen).toEqual([]);
    expect(world.stream.readyState).toBe(2);
  });
});
