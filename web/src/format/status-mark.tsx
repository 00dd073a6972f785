/** The shape of a status, with its name for those who do not see it. */
import type { VNode } from "preact";

import { type Shape, type Status, STATUS } from "./status";

const PATHS: Readonly<Record<Shape, string>> = {
  circle: "M8 3a5 5 0 1 0 0 10a5 5 0 1 0 0-10z",
  diamond: "M8 2l6 6l-6 6l-6-6z",
  triangle: "M8 2.5l6 11h-12z",
  bracket: "M6 2.5h-3v11h3M10 2.5h3v11h-3",
  cross: "M3 3l10 10M13 3l-10 10",
};

interface StatusMarkProps {
  status: Status;
  /** Show the name behind the shape too. */
  named?: boolean;
}

/** The shape of a status. */
export function StatusMark({ status, named = false }: StatusMarkProps): VNode {
  const look = STATUS[status];
  return (
    <span class={`status-mark status-${status}`} title={`${look.label}: ${look.description}`}>
      <svg viewBox="0 0 16 16" width="12" height="12" aria-hidden="true" class={look.filled ? "filled" : ""}>
        <path d={PATHS[look.shape]} />
      </svg>
      <span class={named ? "status-name" : "visually-hidden"}>{look.label}</span>
    </span>
  );
}
