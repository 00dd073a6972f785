/** Flags with their severity by word, shape and colour. */
import type { VNode } from "preact";

import type { Flag } from "../api/types";
import { flagName, ranked, type Severity, severity } from "./flags";

const SYMBOLS: Readonly<Record<Severity, string>> = {
  error: "M8 1l7 14h-14zM8 6v4M8 12v.5",
  warning: "M8 1.5l6.5 6.5l-6.5 6.5l-6.5-6.5zM8 5v3.5M8 10.5v.5",
  info: "M8 2a6 6 0 1 0 0 12a6 6 0 1 0 0-12zM8 7.5v3.5M8 5v.5",
};

/** The shape of a severity. */
export function SeverityMark({ of, size = 16 }: { of: Severity; size?: number }): VNode {
  return (
    <svg class={`severity severity-${of}`} viewBox="0 0 16 16" width={size} height={size} role="img" aria-label={of}>
      <path d={SYMBOLS[of]} />
    </svg>
  );
}

/** All flags, the most severe first, each with its sentence. */
export function FlagList({ flags, none = "No flags." }: { flags: readonly Flag[]; none?: string }): VNode {
  if (flags.length === 0) return <p class="muted">{none}</p>;
  return (
    <ul class="flags">
      {ranked(flags).map((flag) => (
        <li>
          <SeverityMark of={severity(flag.code)} />
          <div>
            <strong>{flagName(flag.code)}</strong> <code class="muted small">{flag.code}</code>
            <p>{flag.detail}</p>
          </div>
        </li>
      ))}
    </ul>
  );
}
