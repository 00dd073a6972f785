/** Whether the page hears of changes as they happen. */
import { signal } from "@preact/signals";

export type Connection = "connecting" | "open" | "lost";

export const connection = signal<Connection>("connecting");

/** When the service last answered, ms; null before. */
export const heard = signal<number | null>(null);
