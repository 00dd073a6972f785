/** The motion from one stage to another: a button that plays it, and a slider. */
import type { Signal } from "@preact/signals";
import type { VNode } from "preact";
import { useEffect, useState } from "preact/hooks";

import { fractionAt, timeAt } from "./playback";

interface PlayerProps {
  id: string;
  from: string;
  to: string;
  /** 0 at the stage compared with, 1 at the stage that is looked at. */
  fraction: Signal<number>;
}

export function Player({ id, from, to, fraction }: PlayerProps): VNode {
  const [isPlaying, setPlaying] = useState(false);
  useEffect(() => {
    if (!isPlaying) return undefined;
    const isReduced = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const begun = performance.now() - 1000 * timeAt(fraction.peek() >= 1 ? 0 : fraction.peek());
    let frame = 0;
    const step = (now: number): void => {
      fraction.value = fractionAt((now - begun) / 1000, isReduced);
      frame = requestAnimationFrame(step);
    };
    frame = requestAnimationFrame(step);
    return () => cancelAnimationFrame(frame);
  }, [isPlaying]);
  const percent = Math.round(100 * fraction.value);
  const isBetween = percent > 0 && percent < 100;
  return (
    <div class="spine-player no-print">
      <button type="button" class="button button-small" aria-pressed={isPlaying} onClick={() => setPlaying(!isPlaying)}>
        {isPlaying ? "Pause" : "Play"}
      </button>
      <label for={`${id}-fraction`}>{from}</label>
      <input
        id={`${id}-fraction`}
        type="range"
        min="0"
        max="100"
        value={percent}
        aria-label={`Motion from ${from} to ${to}`}
        aria-valuetext={isBetween ? `${percent}% of the way, drawn, not measured` : percent === 0 ? from : to}
        onInput={(event) => {
          setPlaying(false);
          fraction.value = Number(event.currentTarget.value) / 100;
        }}
      />
      <span>{to}</span>
      <span class="spine-between">{isBetween ? "between stages: drawn, not measured" : ""}</span>
    </div>
  );
}
