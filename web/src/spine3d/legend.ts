/** What the shapes, dashes and colours of the picture mean. */
import type { Origin } from "../api/types";
import { STATUS } from "../format/status";
import { AXIS_COLOURS } from "./appearance";

export interface LegendEntry {
  readonly key: string;
  readonly label: string;
  readonly note: string;
  readonly kind: "body" | "cross" | "arrow" | "ball" | "ellipse" | "line";
  /** Custom property of the colour. */
  readonly colour: string;
  readonly dash: readonly number[];
  readonly filled: boolean;
}

export interface Shown {
  readonly statuses: ReadonlySet<Origin>;
  readonly hasGaps: boolean;
  readonly before: string | null;
  readonly plan: boolean;
  readonly all: readonly string[];
  readonly vectors: boolean;
  readonly triads: boolean;
  /** How many times larger the 95% regions are drawn; 0 for none. */
  readonly regions: number;
}

const ORDER: readonly Origin[] = ["measured", "interpolated", "assumed"];
const AXES = ["anterior", "left", "cephalad"] as const;

/** Entries for what is shown, and for nothing else. */
export function legendOf(shown: Shown): LegendEntry[] {
  const bodies = ORDER.filter((status) => shown.statuses.has(status)).map(
    (status): LegendEntry => ({ ...STATUS[status], key: status, note: STATUS[status].description, kind: "body" }),
  );
  const entries: (LegendEntry | false)[] = [
    ...bodies,
    shown.hasGaps && { ...STATUS.not_measured, key: "not_measured", note: "no pose: a mark, no shape", kind: "cross" },
    shown.before !== null && entry("before", shown.before, "the stage compared with", "body", "--muted", { filled: true }),
    shown.plan && entry("plan", "plan", "the target of the setup", "body", "--good"),
    shown.all.length > 0 && entry("first", shown.all[0] ?? "", "first of all stages", "line", "--muted"),
    shown.all.length > 1 && entry("last", shown.all.at(-1) ?? "", "last of all stages", "line", "--accent"),
    ...(shown.vectors ? AXES.map((name, k) => entry(name, name, "axis of the vertebra", "arrow", AXIS_COLOURS[k] ?? "--text")) : []),
    shown.triads && entry("triad", "triad", "marker with balls and frame", "ball", "--text", { filled: true }),
    shown.regions > 0 &&
      entry(
        "regions",
        "95% region",
        `of the position; rings: of the tips of the anterior and cephalad axis${shown.regions > 1 ? `; drawn ${shown.regions} times larger` : ""}`,
        "ellipse",
        "--text",
      ),
  ];
  return entries.filter((item) => item !== false);
}

function entry(
  key: string,
  label: string,
  note: string,
  kind: LegendEntry["kind"],
  colour: string,
  { filled = false } = {},
): LegendEntry {
  return { key, label, note, kind, colour, dash: [], filled };
}
