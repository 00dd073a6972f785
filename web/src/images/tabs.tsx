/** Panels of which one is shown, chosen by tabs. */
import type { ComponentChildren, VNode } from "preact";
import { useId, useRef } from "preact/hooks";

export interface Tab {
  key: string;
  name: string;
  content: () => ComponentChildren;
}

interface TabsProps {
  label: string;
  tabs: readonly Tab[];
  shown: string;
  onShow: (key: string) => void;
}

/** Tabs by the pattern of the ARIA Authoring Practices: arrows move between them. */
export function Tabs({ label, tabs, shown, onShow }: TabsProps): VNode {
  const id = useId();
  const list = useRef<HTMLDivElement>(null);
  const index = Math.max(0, tabs.findIndex((tab) => tab.key === shown));
  const onKeyDown = (event: KeyboardEvent): void => {
    const next = nextIndex(event.key, index, tabs.length);
    if (next === null) return;
    event.preventDefault();
    onShow(tabs[next]?.key ?? shown);
    list.current?.querySelectorAll<HTMLElement>("[role=tab]")[next]?.focus();
  };
  return (
    <section class="panel">
      <div class="tabs no-print" role="tablist" aria-label={label} ref={list} onKeyDown={onKeyDown}>
        {tabs.map((tab, k) => (
          <button
            type="button"
            role="tab"
            id={`${id}-tab-${tab.key}`}
            aria-selected={k === index}
            aria-controls={`${id}-panel`}
            tabIndex={k === index ? 0 : -1}
            onClick={() => onShow(tab.key)}
          >
            {tab.name}
          </button>
        ))}
      </div>
      <div role="tabpanel" id={`${id}-panel`} aria-labelledby={`${id}-tab-${tabs[index]?.key ?? ""}`} tabIndex={0} class="tab-panel">
        {tabs[index]?.content()}
      </div>
    </section>
  );
}

function nextIndex(key: string, index: number, count: number): number | null {
  if (key === "ArrowRight") return (index + 1) % count;
  if (key === "ArrowLeft") return (index + count - 1) % count;
  if (key === "Home") return 0;
  return key === "End" ? count - 1 : null;
}
