/** Numbers as text: fixed digits, a true minus sign, units, intervals. */

export const MINUS = "\u2212";
export const DASH = "\u2013";
const NARROW_SPACE = "\u202f";

/** A number with fixed digits and a true minus sign; a dash for none. */
export function fixed(value: number | null | undefined, digits = 1): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return DASH;
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** The same with a plus sign before what is positive: for changes. */
export function signed(value: number | null | undefined, digits = 1): string {
  const text = fixed(value, digits);
  return value !== null && value !== undefined && value > 0 && Number(text) !== 0 ? `+${text}` : text;
}

/** The symbol of a unit of the API: `deg` is shown as a degree sign. */
export function unitSymbol(unit: string): string {
  return unit === "deg" ? "°" : unit;
}

/** A text with its unit behind it; a degree sign follows without a space. */
export function withUnit(text: string, unit: string): string {
  const symbol = unitSymbol(unit);
  if (symbol === "") return text;
  return symbol === "°" || symbol === "%" ? text + symbol : text + NARROW_SPACE + symbol;
}

/** An interval: `55.1 to 61.5°`. */
export function interval(
  low: number | null | undefined,
  high: number | null | undefined,
  unit: string,
  digits = 1,
): string {
  if (fixed(low, digits) === DASH || fixed(high, digits) === DASH) return DASH;
  return withUnit(`${fixed(low, digits)} to ${fixed(high, digits)}`, unit);
}

/** Digits after the point that a standard deviation supports: one more than its first, 0 to 3. */
export function digitsFor(sd: number | null | undefined, fallback = 1): number {
  if (sd === null || sd === undefined || !Number.isFinite(sd) || sd <= 0) return fallback;
  return Math.min(3, Math.max(0, 1 - Math.floor(Math.log10(sd)) - 1));
}
