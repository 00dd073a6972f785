/** The keys of the image views. */
import type { VNode } from "preact";

const KEYS: readonly (readonly [string, string])[] = [
  ["+ −", "zoom"],
  ["0", "fit"],
  ["b", "all balls"],
  ["arrows", "pan"],
  ["n p", "next, previous ball"],
  ["c", "look at the ball"],
  ["enter", "to its numbers"],
  ["esc", "no ball"],
];

const EDITING_KEYS: readonly (readonly [string, string])[] = [
  ["arrows", "on a ball: move by 0.1 px, with shift by 1 px"],
  ["a", "add a ball centre in the middle"],
  ["del", "remove the ball centre"],
  ["ctrl z", "undo"],
];

/** The keys, for everybody to read; the views refer to it. */
export function ViewerHelp({ editing }: { editing: boolean }): VNode {
  return (
    <p id="viewer-help" class="viewer-help small muted no-print">
      {[...KEYS, ...(editing ? EDITING_KEYS : [])].map(([keys, what]) => (
        <span>
          <kbd>{keys}</kbd> {what}
        </span>
      ))}
    </p>
  );
}
