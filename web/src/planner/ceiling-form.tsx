/** The variant of a design with the cameras at the ceiling and the same field of view. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { type BuiltRig, ceilingVariant, type Design } from "./design";

interface CeilingProps {
  design: Design;
  rig: BuiltRig | null;
  onPlan: (design: Design) => void;
}

/** Asks for height and baseline at the ceiling. */
export function CeilingForm({ design, rig, onPlan }: CeilingProps): VNode {
  const [height, setHeight] = useState("2000");
  const [baseline, setBaseline] = useState("1100");
  const [h, b] = [Number(height), Number(baseline)];
  const isSound = rig !== null && h >= 500 && h <= 5000 && b >= 50 && b <= 5000;
  return (
    <form
      class="stack"
      onSubmit={(event) => {
        event.preventDefault();
        if (isSound) onPlan(ceilingVariant(design, rig, h, b));
      }}
    >
      <p class="small muted">The rig at the ceiling, with a focal length that keeps the field of view.</p>
      <div class="design-fields">
        <div class="field">
          <label for="ceiling-height">Height of the cameras, mm</label>
          <input id="ceiling-height" inputMode="decimal" value={height} onInput={(event) => setHeight(event.currentTarget.value)} />
        </div>
        <div class="field">
          <label for="ceiling-baseline">Baseline, mm</label>
          <input id="ceiling-baseline" inputMode="decimal" value={baseline} onInput={(event) => setBaseline(event.currentTarget.value)} />
        </div>
      </div>
      <div class="row">
        <button type="submit" class="button" disabled={!isSound}>At the ceiling</button>
      </div>
    </form>
  );
}
