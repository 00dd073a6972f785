/** What is selected on the page of a surgery, in the 3D view and in the table alike. */
import { signal } from "@preact/signals";

/** Name of the selected vertebra, such as `T9`; null for none. */
export const selectedVertebra = signal<string | null>(null);
