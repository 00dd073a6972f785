/** The legend of the picture. */
import type { VNode } from "preact";

import type { LegendEntry } from "./legend";

export function Legend({ entries }: { entries: readonly LegendEntry[] }): VNode {
  return (
    <ul class="spine-legend" aria-label="Legend">
      {entries.map((entry) => (
        <li key={entry.key}>
          <Swatch entry={entry} />
          <span>
            {entry.label} <span class="muted">{entry.note}</span>
          </span>
        </li>
      ))}
    </ul>
  );
}

function Swatch({ entry: { kind, colour, dash, filled } }: { entry: LegendEntry }): VNode {
  const paint = { stroke: `var(${colour})`, fill: filled ? `var(${colour})` : "none" };
  return (
    <svg class="spine-swatch" viewBox="0 0 28 16" width="28" height="16" aria-hidden="true" {...paint}>
      {kind === "body" && <path d="M5 2.5h18q-2 5.5 0 11h-18q2 -5.5 0 -11z" stroke-dasharray={dash.join(" ")} />}
      {kind === "cross" && <path d="M9 3l10 10M19 3l-10 10" />}
      {kind === "line" && <path d="M2 8h24" stroke-width="4" />}
      {kind === "arrow" && (
        <>
          <path d="M2 8h18" />
          <path d="M18 4l8 4l-8 4z" fill={`var(${colour})`} />
        </>
      )}
      {kind === "ball" && (
        <>
          <path d="M6 12L14 8L23 11M14 8V2" fill="none" />
          <circle cx="6" cy="12" r="2.6" />
          <circle cx="23" cy="11" r="2.6" />
          <circle cx="14" cy="3" r="2.6" />
        </>
      )}
      {kind === "ellipse" && <ellipse cx="14" cy="8" rx="11" ry="5.5" />}
    </svg>
  );
}
