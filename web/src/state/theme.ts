/** The theme: dark for the operating room, light for the desk and for print; remembered by the browser. */
import { effect, signal } from "@preact/signals";

export type Theme = "dark" | "light";

const NAME = "spinewatch-theme";

function remembered(): Theme {
  try {
    return localStorage.getItem(NAME) === "light" ? "light" : "dark";
  } catch {
    return "dark";
  }
}

export const theme = signal<Theme>(remembered());

effect(() => {
  document.documentElement.dataset["theme"] = theme.value;
  try {
    localStorage.setItem(NAME, theme.value);
  } catch {
    // a browser without storage begins with the dark theme each time
  }
});
