/** Scales and paths of small line plots. */

export interface Scale {
  readonly low: number;
  readonly high: number;
  readonly ticks: readonly number[];
}

export interface Place {
  readonly x: number;
  readonly y: number;
}

/** A scale from round numbers over values; from 0 for values that are never negative, unless `isTight`. */
export function scaleOf(values: readonly number[], count = 4, isTight = false): Scale {
  const finite = values.filter(Number.isFinite);
  if (finite.length === 0) return { low: 0, high: 1, ticks: [0, 1] };
  let low = Math.min(...finite);
  let high = Math.max(...finite);
  if (!isTight && low >= 0) low = 0;
  if (high - low < 1e-12) high = low + 1;
  const step = roundStep((high - low) / count);
  low = Math.floor(low / step + 1e-9) * step;
  high = Math.ceil(high / step - 1e-9) * step;
  const ticks = Array.from({ length: Math.round((high - low) / step) + 1 }, (_, index) => Number((low + index * step).toPrecision(12)));
  return { low, high, ticks };
}

/** Where a value lies between two pixels. */
export function placed(scale: Scale, value: number, from: number, to: number): number {
  return from + ((value - scale.low) / (scale.high - scale.low)) * (to - from);
}

/** A path through places; one that is not finite makes a gap. */
export function pathOf(places: readonly Place[]): string {
  let isDown = false;
  return places
    .map(({ x, y }) => {
      if (!Number.isFinite(x) || !Number.isFinite(y)) {
        isDown = false;
        return "";
      }
      const command = `${isDown ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
      isDown = true;
      return command;
    })
    .join("");
}

/** Digits after the point that a scale's ticks need. */
export function tickDigits(scale: Scale): number {
  const [first = 0, second = 1] = scale.ticks;
  return Math.max(0, Math.min(6, -Math.floor(Math.log10(Math.abs(second - first)) + 1e-9)));
}

function roundStep(rough: number): number {
  const power = 10 ** Math.floor(Math.log10(rough));
  const factor = [1, 2, 2.5, 5].find((each) => each * power >= rough - 1e-12) ?? 10;
  return factor * power;
}
