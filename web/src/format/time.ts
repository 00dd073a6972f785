/** Times as text, in the time zone of the browser. */

/** `09:30:12`. */
export function clock(timestamp: string | null | undefined): string {
  const date = parsed(timestamp);
  return date === null ? "\u2013" : [date.getHours(), date.getMinutes(), date.getSeconds()].map(two).join(":");
}

/** `2026-11-21`. */
export function day(timestamp: string | null | undefined): string {
  const date = parsed(timestamp);
  return date === null ? "\u2013" : `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`;
}

/** `2026-11-21 09:30`. */
export function dayAndTime(timestamp: string | null | undefined): string {
  return parsed(timestamp) === null ? "\u2013" : `${day(timestamp)} ${clock(timestamp).slice(0, 5)}`;
}

/** A duration in its two largest units: `42 s`, `3 min 5 s`, `2 h 10 min`, `3 d 4 h`. */
export function duration(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  if (whole < 86400) return `${Math.floor(whole / 3600)} h ${Math.floor((whole % 3600) / 60)} min`;
  return `${Math.floor(whole / 86400)} d ${Math.floor((whole % 86400) / 3600)} h`;
}

/** Seconds between a timestamp and a time in milliseconds; null without a timestamp. */
export function age(timestamp: string | null | undefined, nowMs: number): number | null {
  const date = parsed(timestamp);
  return date === null ? null : (nowMs - date.getTime()) / 1000;
}

function parsed(timestamp: string | null | undefined): Date | null {
  if (!timestamp) return null;
  const date = new Date(timestamp);
  return Number.isNaN(date.getTime()) ? null : date;
}

function two(value: number): string {
  return String(value).padStart(2, "0");
}
