/** How vertebrae look: by status (fill, dash, colour) and by role (now, before, planned, one of all stages). */
import type { Origin } from "../api/types";
import { STATUS } from "../format/status";

export type Rgb = readonly [number, number, number];

/** Colours of the theme by name of their custom property, each from 0 to 1. */
export type Palette = Readonly<Record<string, Rgb>>;

export type Role = "now" | "before" | "plan";

export interface Look {
  readonly fill: Rgb;
  /** 1 hides what is behind, 0 draws no fill. */
  readonly opacity: number;
  readonly edge: Rgb;
  /** Which edges are drawn: of the whole shape, of the body alone, or none. */
  readonly outline: "whole" | "body" | "none";
  /** Lengths of dash and gap, px; a gap of 0 is a line without gaps. */
  readonly dash: readonly [number, number];
  readonly widthPx: number;
}

/** Custom properties that the view draws with. */
export const PALETTE_NAMES: readonly string[] = [
  "--background",
  "--surface",
  "--text",
  "--muted",
  "--line",
  "--focus",
  "--accent",
  "--sky",
  "--good",
  "--green",
  "--blue",
  "--vermillion",
  ...Object.values(STATUS).map((look) => look.colour),
];

/** Custom properties of the body vectors' colours: anterior, left, cephalad. */
export const AXIS_COLOURS = ["--vermillion", "--green", "--sky"] as const;

const GREY: Rgb = [0.5, 0.5, 0.5];

export function colourOf(palette: Palette, name: string): Rgb {
  return palette[name] ?? GREY;
}

export function blend(a: Rgb, b: Rgb, share: number): Rgb {
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share];
}

/** The look of a vertebra. */
export function lookOf(status: Origin, role: Role, palette: Palette, isSelected = false): Look {
  const { filled, dash } = STATUS[status];
  const ground = colourOf(palette, "--background");
  const own = colourOf(palette, STATUS[status].colour);
  const widthPx = isSelected ? 3 : 1.5;
  if (role === "plan") {
    return { fill: ground, opacity: 0, edge: colourOf(palette, "--good"), outline: "body", dash: [1, 0], widthPx: 1.8 };
  }
  if (role === "before") {
    const grey = colourOf(palette, "--muted");
    const edge = blend(grey, ground, 0.2);
    return { fill: grey, opacity: filled ? 0.3 : 0, edge, outline: "body", dash: dashOf(dash), widthPx: 1.3 };
  }
  const edge = isSelected ? colourOf(palette, "--focus") : own;
  const outline = isSelected ? "whole" : filled ? "none" : "body";
  return { fill: filled ? own : blend(ground, own, 0.34), opacity: 1, edge, outline, dash: dashOf(dash), widthPx };
}

/** The colour of one of many stages: from pale for the first to the accent for the last. */
export function stageColour(index: number, count: number, palette: Palette): Rgb {
  const share = count < 2 ? 1 : index / (count - 1);
  const pale = blend(colourOf(palette, "--muted"), colourOf(palette, "--background"), 0.35);
  return blend(pale, colourOf(palette, "--accent"), share);
}

export function dashOf(lengths: readonly number[]): readonly [number, number] {
  return [lengths[0] ?? 1, lengths[1] ?? 0];
}
