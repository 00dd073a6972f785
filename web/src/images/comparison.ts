/** Two takes of the same images compared: labels, positions and ball centres. */
import { type Side, SIDES } from "./camera";
import { sameTriad } from "./rebase";
import { centreAt, type Scene, type SceneTriad, triadName } from "./scene";
import { distance2, length, subtract, type Vec2 } from "./vectors";

export interface TriadDifference {
  name: string;
  /** Labels then and now; the same text when nothing changed. */
  labelThen: string | null;
  labelNow: string | null;
  /** Which take has it. */
  in: "both" | "then" | "now";
  /** Distance between both positions of P, mm; null unless both takes have a pose. */
  movedMm: number | null;
  /** Largest movement of a ball centre in each image, px. */
  movedPx: Readonly<Record<Side, number | null>>;
}

/** The place of a ball in an earlier take, and where it is now. */
export interface BallShift {
  side: Side;
  then: Vec2;
  now: Vec2 | null;
}

export interface Comparison {
  triads: TriadDifference[];
  shifts: BallShift[];
}

/** Compare a take with an earlier one of the same images. */
export function compared(then: Scene, now: Scene): Comparison {
  const triads: TriadDifference[] = [];
  const shifts: BallShift[] = [];
  const found = new Set<number>();
  for (const before of then.triads) {
    const after = sameTriad(before, now);
    if (after !== null) found.add(after.index);
    shifts.push(...shiftsOf(then, before, now, after));
    triads.push({
      name: triadName(after ?? before),
      labelThen: before.label,
      labelNow: after?.label ?? null,
      in: after === null ? "then" : "both",
      movedMm:
        after === null || before.position === null || after.position === null
          ? null
          : length(subtract(after.position, before.position)),
      movedPx: { left: largest(then, before, now, after, "left"), right: largest(then, before, now, after, "right") },
    });
  }
  for (const triad of now.triads) {
    if (found.has(triad.index)) continue;
    const none = { labelThen: null, movedMm: null, movedPx: { left: null, right: null } };
    triads.push({ name: triadName(triad), labelNow: triad.label, in: "now", ...none });
  }
  return { triads, shifts };
}

/** Whether anything differs between two takes. */
export function differs(comparison: Comparison): boolean {
  return comparison.triads.some(
    (triad) =>
      triad.in !== "both" ||
      triad.labelThen !== triad.labelNow ||
      SIDES.some((side) => (triad.movedPx[side] ?? 0) > 0) ||
      (triad.movedMm ?? 0) > 0,
  );
}

function shiftsOf(then: Scene, before: SceneTriad, now: Scene, after: SceneTriad | null): BallShift[] {
  return before.balls.flatMap((ball) =>
    SIDES.flatMap((side): BallShift[] => {
      const old = centreAt(then, side, ball[side]);
      const same = after?.balls.find((candidate) => candidate.name === ball.name);
      const next = same === undefined ? null : centreAt(now, side, same[side]);
      return old === null ? [] : [{ side, then: old.pixel, now: next?.pixel ?? null }];
    }),
  );
}

function largest(then: Scene, before: SceneTriad, now: Scene, after: SceneTriad | null, side: Side): number | null {
  const distances = shiftsOf(then, before, now, after).flatMap((shift) =>
    shift.side === side && shift.now !== null ? [distance2(shift.then, shift.now)] : [],
  );
  return distances.length === 0 ? null : Math.max(...distances);
}
