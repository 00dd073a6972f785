/** The colours of the theme as numbers. */
import { type Palette, PALETTE_NAMES, type Rgb } from "./appearance";

/** Read the custom properties that hold where an element is. */
export function readPalette(element: HTMLElement): Palette {
  // One new element for each: a changed colour would begin a transition, and be read as it was before.
  const probes = PALETTE_NAMES.map((name) => {
    const probe = document.createElement("span");
    probe.style.color = `var(${name})`;
    return probe;
  });
  element.append(...probes);
  const colours = probes.map((probe, k): [string, Rgb] => [
    PALETTE_NAMES[k] ?? "",
    parseRgb(getComputedStyle(probe).color),
  ]);
  for (const probe of probes) probe.remove();
  return Object.fromEntries(colours);
}

/** The three shares of `rgb(1, 2, 3)`, 0 to 1; grey for anything else. */
export function parseRgb(text: string): Rgb {
  const [r, g, b] = (/^rgba?\(([^)]*)\)$/.exec(text)?.[1] ?? "").split(/[\s,/]+/).map(Number);
  if (![r, g, b].every((value) => value !== undefined && Number.isFinite(value))) return [0.5, 0.5, 0.5];
  return [(r ?? 0) / 255, (g ?? 0) / 255, (b ?? 0) / 255];
}
