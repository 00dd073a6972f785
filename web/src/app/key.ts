/** The API key that `spinewatch run` puts into the address: `#key=...`. A fragment is never sent to a server. */
import { paths, replace } from "./route";

const FORM = /^#key=(sw_[A-Za-z0-9_]+)$/;

/** Return the key in the address, and remove it from there and from the history; null without one. */
export function takeKey(): string | null {
  const key = FORM.exec(location.hash)?.[1];
  if (key === undefined) return null;
  replace(paths.surgeries);
  return key;
}
