/** How measured, interpolated, assumed, bracketed and unmeasured things look, the same everywhere. */
import type { MeasureStatus, Origin } from "../api/types";

export type Status = Origin | MeasureStatus;
export type Shape = "circle" | "diamond" | "triangle" | "bracket" | "cross";

export interface StatusLook {
  readonly label: string;
  readonly description: string;
  readonly shape: Shape;
  /** Lengths of dash and gap for lines, px; empty for a line without gaps. */
  readonly dash: readonly number[];
  /** Whether shapes are filled or outlined. */
  readonly filled: boolean;
  /** Custom property of the colour. */
  readonly colour: string;
}

export const STATUS: Readonly<Record<Status, StatusLook>> = {
  measured: {
    label: "measured",
    description: "from its own marker",
    shape: "circle",
    dash: [],
    filled: true,
    colour: "--status-measured",
  },
  interpolated: {
    label: "interpolated",
    description: "from the markers above and below",
    shape: "diamond",
    dash: [8, 4],
    filled: false,
    colour: "--status-interpolated",
  },
  assumed: {
    label: "assumed",
    description: "from an assumed initial configuration",
    shape: "triangle",
    dash: [2, 4],
    filled: false,
    colour: "--status-assumed",
  },
  bracketed: {
    label: "bracketed",
    description: "between markers: the interval holds what other interpolations give",
    shape: "bracket",
    dash: [12, 3, 2, 3],
    filled: false,
    colour: "--status-bracketed",
  },
  not_measured: {
    label: "not measured",
    description: "no value",
    shape: "cross",
    dash: [1, 7],
    filled: false,
    colour: "--status-none",
  },
};
