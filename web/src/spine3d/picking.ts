/** Which vertebra is at a place on the screen. */
import type { Body } from "./bodies";
import { matrixOfQuaternion } from "./rotations";
import { apply, subtract, transpose, type Vec3 } from "./vectors";
import { basisOf, type Screen, unproject, type View } from "./views";

/** Half sizes of the box that is picked, as multiples of the body's size, and its middle: the processes count too. */
const HALF: Vec3 = [0.5, 0.62, 0.5];
const BACK = 1.0;

/** The nearest body that a ray meets; null where it meets none. */
export function pick(bodies: readonly Body[], view: View, screen: Screen, x: number, y: number): Body | null {
  const { toward } = basisOf(view);
  const point = unproject(view, screen, x, y);
  let found: Body | null = null;
  let nearest = -Infinity;
  for (const body of bodies) {
    const along = meets(body, point, toward);
    if (along !== null && along > nearest) [found, nearest] = [body, along];
  }
  return found;
}

/** How far towards the viewer a line first leaves a body's boxes, mm; null when it misses them. */
function meets(body: Body, point: Vec3, toward: Vec3): number | null {
  const toBody = transpose(matrixOfQuaternion(body.rotation));
  const from = apply(toBody, subtract(point, body.position));
  const direction = apply(toBody, toward);
  const [depth, width, height] = body.size;
  const half: Vec3 = [HALF[0] * depth, HALF[1] * width, HALF[2] * height];
  const arch: Vec3 = [0.5 * BACK * depth, 0.35 * width, 0.35 * height];
  const inArch = subtract(from, [-(0.5 + 0.5 * BACK) * depth, 0, 0]);
  const hits = [slab(from, direction, half), slab(inArch, direction, arch)].filter((hit) => hit !== null);
  return hits.length === 0 ? null : Math.max(...hits);
}

function slab(from: Vec3, direction: Vec3, half: Vec3): number | null {
  let [enter, leave] = [-Infinity, Infinity];
  for (const axis of [0, 1, 2] as const) {
    const [p, d, h] = [from[axis], direction[axis], half[axis]];
    if (Math.abs(d) < 1e-12) {
      if (Math.abs(p) > h) return null;
      continue;
    }
    const ends = [(-h - p) / d, (h - p) / d];
    enter = Math.max(enter, Math.min(...ends));
    leave = Math.min(leave, Math.max(...ends));
  }
  return enter <= leave ? leave : null;
}

/** The vertebra after or before the selected one, cranial first; without a selection the first or the last. */
export function neighbour(levels: readonly string[], selected: string | null, step: 1 | -1): string | null {
  const at = selected === null ? -1 : levels.indexOf(selected);
  if (at < 0) return levels.at(step === 1 ? 0 : -1) ?? null;
  return levels[Math.min(levels.length - 1, Math.max(0, at + step))] ?? null;
}
