/** What keeps a correction from being lost: undo by keys, and a warning before the window closes. */
import { useEffect } from "preact/hooks";

import { type Draft, redone, undone } from "./draft";

/** Ask before the window closes while something is not saved. */
export function useWarningBeforeLeaving(isUnsaved: boolean): void {
  useEffect(() => {
    if (!isUnsaved) return undefined;
    const warn = (event: BeforeUnloadEvent): void => event.preventDefault();
    addEventListener("beforeunload", warn);
    return () => removeEventListener("beforeunload", warn);
  }, [isUnsaved]);
}

/** The correction after Ctrl+Z, Ctrl+Y or Ctrl+Shift+Z; null for other keys, and in fields, which undo by themselves. */
export function afterUndoKey(event: KeyboardEvent, draft: Draft): Draft | null {
  const isField = event.target instanceof HTMLInputElement && event.target.type === "number";
  if (isField || !(event.ctrlKey || event.metaKey)) return null;
  const key = event.key.toLowerCase();
  if (key !== "z" && key !== "y") return null;
  return key === "y" || event.shiftKey ? redone(draft) : undone(draft);
}
