/** Switches between the dark theme of the operating room and the light one of the desk. */
import type { VNode } from "preact";

import { theme } from "../state/theme";

/** A button with the name of the other theme. */
export function ThemeButton(): VNode {
  const other = theme.value === "dark" ? "light" : "dark";
  return (
    <button
      type="button"
      class="button button-small"
      onClick={() => {
        theme.value = other;
      }}
    >
      <svg viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
        <circle cx="8" cy="8" r="6" fill="none" stroke="currentColor" stroke-width="2" />
        <path d="M8 2a6 6 0 0 1 0 12z" fill="currentColor" />
      </svg>
      {other === "dark" ? "Dark" : "Light"} theme
    </button>
  );
}
