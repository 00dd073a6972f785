/** Both radiographs side by side with their landmarks, the fit, and saving it into the setup of the spine. */
import type { VNode } from "preact";
import { useLayoutEffect, useMemo, useReducer, useState } from "preact/hooks";

import type { Tagged } from "../api/client";
import type { Radiograph, StoredSpineSetup, Surgery } from "../api/types";
import { CommonPoints } from "./common-points";
import { toDocument } from "./document";
import { forgetDraft, keepDraft } from "./draft-store";
import { type Action, reduce, startEditor } from "./editor";
import { Film } from "./film";
import { FitPanel } from "./fit-panel";
import { bandOf, type Geometry } from "./geometry";
import { CurrentLandmark, LandmarkTable } from "./landmark-side";
import { type Landmarks, neighbour, nextOpen, pointAt, type Slot, type View } from "./landmarks";
import { LevelChoice } from "./level-choice";
import { SaveFit } from "./save-fit";
import { useFit } from "./use-fit";
import type { Size } from "./viewport";

interface DigitizerProps {
  surgery: Surgery;
  pa: Radiograph;
  lateral: Radiograph;
  start: { landmarks: Landmarks; sdPx: number; stage: string | null };
  stored: Tagged<StoredSpineSetup> | null;
  reload: () => Promise<void>;
}

/** The work on one pair of radiographs. */
export function Digitizer({ surgery, pa, lateral, start, stored, reload }: DigitizerProps): VNode {
  const [editor, dispatch] = useReducer(reduce, start.landmarks, startEditor);
  const [sdPx, setSdPx] = useState(start.sdPx);
  const stages = useMemo(() => stageNames(surgery), [surgery]);
  const [stage, setStage] = useState(start.stage ?? stored?.value.setup.baseline ?? stages[0] ?? null);
  const radiographs: Readonly<Record<View, Radiograph>> = { pa, lateral };
  const geometry = useMemo((): Geometry => ({ pa: geometryOf(pa), lateral: geometryOf(lateral) }), [pa, lateral]);
  const { landmarks } = editor;
  const document = useMemo(
    () => toDocument(landmarks, { pa: pa.id, lateral: lateral.id }, geometry, sdPx),
    [landmarks, pa, lateral, geometry, sdPx],
  );
  const named = landmarks.common.some(({ place }) => place.kind === "triad");
  const fit = useFit(surgery.id, document.initial, named ? stage : null);
  const bands = (slot: Slot) => bandOf(geometry, landmarks, slot, sdPx);
  // kept before anybody sees the change: a tab that is closed or loaded again at once runs no later effect
  useLayoutEffect(() => {
    keepDraft(surgery.id, { pa: pa.id, lateral: lateral.id, sdPx, stage, landmarks });
  }, [surgery.id, pa.id, lateral.id, sdPx, stage, landmarks]);

  const onNext = (step: 1 | -1): void => {
    const { selected } = editor;
    const open = step === 1 && selected !== null && pointAt(landmarks, selected) !== null ? nextOpen(landmarks, selected, editor.skipped) : null;
    act({ type: "select", slot: open ?? neighbour(landmarks, selected, step) });
  };
  const act = (action: Action): void => {
    dispatch(action);
  };

  return (
    <>
      <div class="films">
        {(["pa", "lateral"] as const).map((view) => (
          <Film
            key={radiographs[view].id}
            view={view}
            source={`/v1/surgeries/${encodeURIComponent(surgery.id)}/radiographs/${encodeURIComponent(radiographs[view].id)}/image`}
            size={sizeOf(radiographs[view])}
            editor={editor}
            band={editor.selected?.view === view ? bands(editor.selected) : null}
            positiveOn={radiographs[view].positive_on}
            dispatch={act}
            onNext={onNext}
          />
        ))}
        <div class="stack landmarks-side">
          <CurrentLandmark editor={editor} bands={bands} dispatch={act} onNext={onNext} />
          <LandmarkTable editor={editor} dispatch={act} />
        </div>
      </div>
      <div class="digitizer-below">
        <div class="stack">
          <LevelChoice landmarks={landmarks} surgery={surgery} dispatch={act} />
          <CommonPoints common={landmarks.common} marked={surgery.vertebrae} dispatch={act} />
          <section class="panel stack" aria-labelledby="fit-options">
            <h2 id="fit-options">Errors and stage</h2>
            <div class="coordinates">
              <div class="field">
                <label for="landmark-sd">Landmark sd per axis, px</label>
                <input
                  id="landmark-sd"
                  type="number"
                  min="0.1"
                  max="50"
                  step="0.1"
                  value={sdPx}
                  onChange={(event) => {
                    const value = Number(event.currentTarget.value);
                    if (value > 0 && value <= 50) setSdPx(value);
                  }}
                />
              </div>
              <div class="field">
                <label for="fit-stage">Stage of the triads</label>
                <select id="fit-stage" value={stage ?? ""} disabled={stages.length === 0} onChange={(event) => setStage(event.currentTarget.value || null)}>
                  {stages.length === 0 && <option value="">no stage yet</option>}
                  {stages.map((name) => <option value={name}>{name}</option>)}
                </select>
              </div>
            </div>
          </section>
        </div>
        <div class="stack">
          <FitPanel state={fit} faults={document.faults} dispatch={act} />
          <SaveFit
            surgeryId={surgery.id}
            initial={fit.state === "ready" ? document.initial : null}
            stored={stored}
            reload={reload}
            onSaved={() => forgetDraft(surgery.id)}
          />
        </div>
      </div>
    </>
  );
}

function geometryOf(radiograph: Radiograph): Geometry[View] {
  const [row = 1, column = 1] = radiograph.pixel_spacing_mm;
  return { spacingMm: [row, column], positiveOn: radiograph.positive_on };
}

function sizeOf({ image }: Radiograph): Size {
  return { width: image.width_px, height: image.height_px };
}

/** Names of the stages that were measured, in order. */
function stageNames(surgery: Surgery): string[] {
  return [...new Set(surgery.stages.filter(({ state }) => state === "succeeded").map(({ name }) => name))];
}
