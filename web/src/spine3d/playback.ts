/** The animation between two stages: it stays at each and moves to the other. */

const HOLD_S = 1;
const MOVE_S = 2;
const PERIOD_S = 2 * (HOLD_S + MOVE_S);

/** The fraction of the way at a time, s; without motion it jumps when half of the time to move is over. */
export function fractionAt(seconds: number, isReduced: boolean): number {
  const time = ((seconds % PERIOD_S) + PERIOD_S) % PERIOD_S;
  const isBack = time >= PERIOD_S / 2;
  const moved = Math.min(1, Math.max(0, (time - (isBack ? PERIOD_S / 2 : 0) - HOLD_S) / MOVE_S));
  const eased = isReduced ? Number(moved >= 0.5) : moved * moved * (3 - 2 * moved);
  return isBack ? 1 - eased : eased;
}

/** A time at which the animation is at a fraction of the way there, s: where it goes on from. */
export function timeAt(fraction: number): number {
  if (fraction >= 1) return HOLD_S + MOVE_S;
  let [low, high] = [0, 1];
  for (let step = 0; step < 30; step += 1) {
    const moved = (low + high) / 2;
    if (moved * moved * (3 - 2 * moved) < fraction) low = moved;
    else high = moved;
  }
  return fraction <= 0 ? 0 : HOLD_S + MOVE_S * low;
}
