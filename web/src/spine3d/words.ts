/** The picture in words. */
import type { StageSpine } from "../api/types";
import { apexAndSide } from "../format/curve";
import { STATUS } from "../format/status";
import { bodiesOf, gapsOf, runName } from "./bodies";

export interface Described {
  readonly spine: StageSpine;
  readonly before: string | null;
  readonly hasPlan: boolean;
  readonly stages: number;
  readonly selected: string | null;
}

/** One text for those who do not see the picture; the numbers are in the table of the vertebrae. */
export function describe({ spine, before, hasPlan, stages, selected }: Described): string {
  const bodies = bodiesOf(spine);
  const counts = (["measured", "interpolated", "assumed"] as const)
    .map((status) => ({ status, count: bodies.filter((body) => body.status === status).length }))
    .filter(({ count }) => count > 0)
    .map(({ status, count }) => `${count} ${STATUS[status].label}`);
  const gaps = gapsOf(spine).map(({ levels }) => runName(levels));
  const sentences = [
    `3D view of the spine at stage ${spine.stage}: ${counts.join(", ") || "no vertebra with a pose"}`,
    gaps.length > 0 && `Not measured: ${gaps.join(", ")}`,
    ...spine.curves.map(
      (curve) => `${capital(curve.name)} from ${curve.upper} to ${curve.lower}, ${apexAndSide(curve)}`,
    ),
    before !== null && `Laid over stage ${before}`,
    stages > 1 && `All ${stages} stages are drawn`,
    hasPlan && "The plan is drawn too",
    selected !== null && `${selected} is selected`,
  ];
  return sentences.filter((sentence) => sentence !== false).join(". ").concat(". The numbers are in the table of the vertebrae.");
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
