/** How triads and marks look over the images: colour, line and name tell them apart. */

export interface TriadLook {
  /** Number of the colour: class `triad-colour-N`. */
  colour: number;
  /** Lengths of dash and gap, screen px; empty for a line without gaps. */
  dash: string;
}

const COLOURS = 6;
const DASHES = ["", "7 4", "2 4", "10 3 2 3"] as const;

/** The look of a triad by its place along the spine: neighbours differ in colour and in line. */
export function triadLook(index: number): TriadLook {
  return { colour: index % COLOURS, dash: DASHES[(index + Math.floor(index / COLOURS)) % DASHES.length] ?? "" };
}

/** What is drawn over the images. */
export interface Layers {
  triads: boolean;
  outlines: boolean;
  ellipses: boolean;
  labels: boolean;
  features: boolean;
  discarded: boolean;
}

export const LAYERS: Layers = {
  triads: true,
  outlines: true,
  ellipses: true,
  labels: true,
  features: false,
  discarded: false,
};

/** Names of the layers, as the page lists them. */
export const LAYER_NAMES: Readonly<Record<keyof Layers, string>> = {
  triads: "Triads",
  outlines: "Ball outlines",
  ellipses: "95% ellipses",
  labels: "Labels",
  features: "Other features",
  discarded: "Discarded candidates",
};

/** The points of a line or an outline, for the attribute of an SVG element. */
export function pointsText(points: readonly (readonly [number, number])[]): string {
  return points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
}
