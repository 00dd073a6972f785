/** Keeps the page up to date while somebody is signed in. */
import { effect } from "@preact/signals";

import { connection, heard } from "../state/connection";
import { signedIn } from "../state/session";
import { announce } from "./changes";
import { get } from "./client";
import { Feed } from "./feed";
import { refresh } from "./resource";
import type { Changes } from "./types";

const PATIENCE_MS = 4000;

/** Follow the changes of the service whenever somebody is signed in. */
export function followChanges(): void {
  effect(() => {
    if (!signedIn.value) return undefined;
    const feed = new Feed({
      open: (since) => new EventSource(`/v1/events?since=${since}`),
      ask: (since) =>
        get<Changes>(`/v1/changes?since=${since}&limit=1000`, { signal: AbortSignal.timeout(PATIENCE_MS) }),
      change: announce,
      reread: () => refresh("/v1/"),
      state: (state) => {
        connection.value = state;
        if (state === "open") heard.value = Date.now();
      },
    });
    const suspect = (): void => feed.suspect();
    const check = (): void => feed.check();
    addEventListener("offline", suspect);
    addEventListener("online", check);
    addEventListener("focus", check);
    feed.start();
    return () => {
      feed.stop();
      removeEventListener("offline", suspect);
      removeEventListener("online", check);
      removeEventListener("focus", check);
    };
  });
}
