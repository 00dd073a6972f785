/** Whether what is shown is the newest that the service has. */
import type { VNode } from "preact";

import { clock, duration } from "../format/time";
import { type Connection, connection, heard } from "../state/connection";
import { now } from "../state/now";

const BADGES: Readonly<Record<Connection, { label: string; look: string; title: string }>> = {
  connecting: { label: "Connecting", look: "badge", title: "The page asks the service for its newest state." },
  open: { label: "Live", look: "badge badge-good", title: "New stages appear by themselves." },
  lost: { label: "No connection", look: "badge badge-error", title: "The service does not answer." },
};

/** The state of the connection in one word. */
export function ConnectionBadge(): VNode {
  const { label, look, title } = BADGES[connection.value];
  return (
    <span class={look} title={title}>
      <svg viewBox="0 0 10 10" width="9" height="9" aria-hidden="true">
        {connection.value === "lost" ? (
          <path d="M1 1l8 8M9 1l-8 8" stroke="currentColor" stroke-width="2" />
        ) : (
          <circle cx="5" cy="5" r="4" fill={connection.value === "open" ? "currentColor" : "none"} stroke="currentColor" stroke-width="2" />
        )}
      </svg>
      {label}
    </span>
  );
}

/** A banner over the page while the connection is lost. */
export function ConnectionBanner(): VNode | null {
  if (connection.value !== "lost") return null;
  const since = heard.value;
  return (
    <div class="connection-banner">
      <span role="alert">No connection to the service. The page tries again by itself.</span>{" "}
      {since === null
        ? "Nothing is known of its state."
        : `What is shown is of ${clock(new Date(since).toISOString())}, ${duration((now.value - since) / 1000)} ago.`}
    </div>
  );
}
