/** Scales of plots: ranges, ticks and positions. */

export type Range = readonly [number, number];

/** Steps of ticks within one power of ten. */
const STEPS = [1, 2, 2.5, 5, 10] as const;

/** Return the range of some numbers with a margin; those that are not known are left out. */
export function rangeOf(values: Iterable<number | null | undefined>, margin = 0.08, least = 1): Range {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value === null || value === undefined || !Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return [-least, least];
  const extent = Math.max(high - low, least);
  const middle = (low + high) / 2;
  return [middle - extent * (0.5 + margin), middle + extent * (0.5 + margin)];
}

/** Return the range widened so that zero lies in it. */
export function withZero([low, high]: Range): Range {
  return [Math.min(low, 0), Math.max(high, 0)];
}

/** Return a range with zero in its middle. */
export function symmetric(values: Iterable<number | null | undefined>, margin = 0.08, least = 1): Range {
  const [low, high] = withZero(rangeOf(values, margin, least));
  const end = Math.max(-low, high);
  return [-end, end];
}

/** Return round numbers within a range, about as many as wanted. */
export function ticks([low, high]: Range, wanted = 4): number[] {
  if (!(high > low) || wanted < 1) return [];
  const rough = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = (STEPS.find((candidate) => candidate * power >= rough * 0.999) ?? 10) * power;
  const found: number[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) found.push(rounded(k * step, step));
  return found;
}

/** Return digits after the point that ticks need to differ. */
export function tickDigits(found: readonly number[]): number {
  const step = found.length > 1 ? Math.abs((found[1] ?? 0) - (found[0] ?? 0)) : 1;
  for (let digits = 0; digits < 4; digits += 1) {
    if (Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) < 1e-6) return digits;
  }
  return 4;
}

/** Return the linear map of a range onto another one. */
export function linear([low, high]: Range, [start, end]: Range): (value: number) => number {
  const slope = (end - start) / (high - low);
  return (value) => start + slope * (value - low);
}

/** Return the logarithmic map of a range of positive numbers; smaller ones are drawn at its beginning. */
export function logarithmic([low, high]: Range, [start, end]: Range): (value: number) => number {
  const map = linear([Math.log10(low), Math.log10(high)], [start, end]);
  return (value) => map(Math.log10(Math.min(high, Math.max(low, value))));
}

/** Return the powers of ten within a range of positive numbers. */
export function decades([low, high]: Range): number[] {
  const found: number[] = [];
  for (let k = Math.ceil(Math.log10(low) - 1e-9); k <= Math.log10(high) + 1e-9; k += 1) found.push(Number((10 ** k).toPrecision(1)));
  return found;
}

/** Return which of n labels are shown when there is room for a few: the ends, one that matters, and some between. */
export function shownLabels(n: number, room: number, important: number | null = null): Set<number> {
  const every = Math.max(1, Math.ceil(n / Math.max(1, room)));
  const shown = new Set<number>();
  const keep = [important, 0, n - 1].filter((i): i is number => i !== null && i >= 0 && i < n);
  const between = Array.from({ length: n }, (_, i) => i).filter((i) => i % every === 0);
  for (const i of [...keep, ...between]) {
    if ([...shown].every((other) => Math.abs(other - i) >= every)) shown.add(i);
  }
  return shown;
}

function rounded(value: number, step: number): number {
  const digits = Math.max(0, 2 - Math.floor(Math.log10(step)));
  return Number(value.toFixed(Math.min(12, digits)));
}
