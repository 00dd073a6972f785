/** A number with its deviation and unit, or a dash with the reason. */
import type { VNode } from "preact";

import { DASH, fixed, interval as intervalText, signed, unitSymbol, withUnit } from "./numbers";

export interface QuantityProps {
  value: number | null | undefined;
  /** Standard deviation; null when there is none. */
  sd?: number | null | undefined;
  /** `deg`, `°`, `mm`, `px`, ... */
  unit: string;
  digits?: number;
  /** Ends of the 95% interval; shown after the value. */
  interval?: readonly (number | null)[] | null | undefined;
  /** Why there is no value, or why it is doubtful. */
  reason?: string | null | undefined;
  /** Show a plus sign: for changes. */
  change?: boolean;
}

/** `58.3 ± 0.6°`; a dash with its reason when there is no value. */
export function Quantity({ value, sd, unit, digits = 1, interval, reason, change = false }: QuantityProps): VNode {
  if (value === null || value === undefined || !Number.isFinite(value)) {
    const why = reason ?? "not measured";
    return (
      <span class="quantity quantity-none" title={why}>
        <span aria-hidden="true">{DASH}</span>
        <span class="visually-hidden">none: {why}</span>
      </span>
    );
  }
  const number = change ? signed(value, digits) : fixed(value, digits);
  const hasDeviation = sd !== null && sd !== undefined && Number.isFinite(sd);
  const symbol = unitSymbol(unit);
  const ends = interval?.length === 2 ? intervalText(interval[0], interval[1], unit, digits) : DASH;
  return (
    <span class="quantity" title={reason ?? undefined}>
      <span class="quantity-value">{hasDeviation ? number : withUnit(number, unit)}</span>
      {hasDeviation && <span class="quantity-sd"> ± {withUnit(fixed(sd, digits), symbol)}</span>}
      {ends !== DASH && <span class="quantity-interval"> ({ends})</span>}
    </span>
  );
}
