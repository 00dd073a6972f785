/** A button that copies a table. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

interface CopyButtonProps {
  /** Makes the text when the button is pressed. */
  text: () => string;
  label?: string;
}

/** Copies a text, and says whether that worked. */
export function CopyButton({ text, label = "Copy table" }: CopyButtonProps): VNode {
  const [said, setSaid] = useState("");
  async function copyNow(): Promise<void> {
    const copied = await copy(text());
    setSaid(copied ? "Copied" : "Not copied: the browser refuses it. Select the table and copy it.");
  }
  return (
    <span class="row no-print">
      <span role="status" class="muted small">
        {said}
      </span>
      <button type="button" class="button button-small" onClick={() => void copyNow()} onBlur={() => setSaid("")}>
        {label}
      </button>
    </span>
  );
}

/** Copy a text; pages without TLS have no clipboard, so a selection is copied there. */
async function copy(text: string): Promise<boolean> {
  if (navigator.clipboard !== undefined) {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      // not permitted: the selection below may still be
    }
  }
  const area = document.createElement("textarea");
  area.value = text;
  area.className = "visually-hidden";
  area.setAttribute("aria-hidden", "true");
  const focused = document.activeElement;
  document.body.append(area);
  area.select();
  const copied = document.execCommand("copy");
  area.remove();
  if (focused instanceof HTMLElement) focused.focus();
  return copied;
}
