/** Both images of a pair with everything around them: tools, the chosen ball, tables, and a correction. */
import type { ComponentChildren, VNode } from "preact";
import { useMemo, useRef, useState } from "preact/hooks";

import { type ProblemError, send } from "../api/client";
import { refresh } from "../api/resource";
import type { Stage, Surgery } from "../api/types";
import { type Side, SIDES } from "./camera";
import { ConflictNotice } from "./conflict-notice";
import { CorrectionPanel } from "./correction-panel";
import { stagePath, type TakeDocuments } from "./documents";
import { appended, changesOf, type Draft, type Edit, nextKey, redone, revisionOf, undone, wrongWith } from "./draft";
import { FoundTabs } from "./found-tabs";
import { afterUndoKey, useWarningBeforeLeaving } from "./guards";
import { LAYERS, type Layers } from "./looks";
import { visibleCentres } from "./overlay";
import { asProblem } from "./save-progress";
import { ballCentres, type Centre, centreAt, partnerOf } from "./scene";
import { SelectionPanel } from "./selection-panel";
import { Toolbar } from "./toolbar";
import { middleOf, shownTriplet } from "./triplet";
import { useContrast } from "./use-contrast";
import { usePicture } from "./use-picture";
import { ellipseFactor, useScene } from "./use-scene";
import { useSize } from "./use-size";
import type { Vec2 } from "./vectors";
import { centred, fitted, framed, kept, type View, zoomed } from "./view";
import { Viewer, type ViewerActions } from "./viewer";
import { ViewerHelp } from "./viewer-help";

export interface WorkspaceProps {
  surgery: Surgery;
  documents: TakeDocuments;
  takes: readonly Stage[];
  counted: Stage | null;
  shown: Stage;
  pair: number;
  draft: Draft;
  editing: boolean;
  isSaving: boolean;
  compared: number | null;
  earlier: TakeDocuments | null;
  /** What is said above the chosen ball: progress of saving, and its result. */
  notice: ComponentChildren;
  onDraft: (draft: Draft) => void;
  onSaved: (job: string, take: number) => void;
  onLeave: () => void;
  onCarry: (draft: Draft, take: number) => void;
  onShow: (take: number) => void;
  onCompare: (take: number | null) => void;
}

interface Place {
  side: Side;
  key: string;
}

/** Zoom at which a ball is looked at. */
const CLOSE_ZOOM = 6;

/** The workspace of one pair of one take. */
export function Workspace(props: WorkspaceProps): VNode {
  const { surgery, documents, shown, pair, draft } = props;
  const [selected, setSelected] = useState<Place | null>(null);
  const [hovered, setHovered] = useState<Place | null>(null);
  const [candidate, setCandidate] = useState<number | null>(null);
  const [layers, setLayers] = useState<Layers>(LAYERS);
  const [moved, setMoved] = useState<View | null>(null);
  const [adding, setAdding] = useState(false);
  const [tab, setTab] = useState("balls");
  const [sending, setSending] = useState(false);
  const [problem, setProblem] = useState<ProblemError | null>(null);
  useWarningBeforeLeaving(draft.count > 0);

  const state = useScene(surgery, shown, documents, props.earlier, draft);
  const { scene, rig } = state;
  const explanation = documents.candidates.explanation;
  const stage = stagePath(surgery.id, shown.name);
  const imagePath = (side: Side): string => `${stage}/images/${side}?take=${shown.take}&pair=${pair}`;
  const pictures = { left: usePicture(imagePath("left")), right: usePicture(imagePath("right")) };
  const gray = useContrast(pictures.left, pictures.right);

  const box = useRef<HTMLDivElement>(null);
  const size = useSize(box);
  const whole = fitted(size, rig.left.size, rig.right.size);
  const view = moved ?? whole;
  const factor = ellipseFactor(scene, view.zoom);
  const show = (next: View): void => setMoved(kept(next, rig.left.size, rig.right.size));
  const frame = (): void => {
    const places = (side: Side): Vec2[] => ballCentres(scene, side).map((centre) => centre.pixel);
    setMoved(framed(size, places("left"), places("right"), whole.zoom));
  };

  const centreOf = (place: Place | null): Centre | null => (place === null ? null : centreAt(scene, place.side, place.key));
  const chosen = centreOf(selected);
  const active = centreOf(hovered) ?? chosen;
  const epipolar = useMemo(() => state.epipolarOf(active), [active, scene, rig]);
  const chosenEpipolar = useMemo(() => state.epipolarOf(chosen), [chosen, scene, rig]);
  const triplet = candidate === null ? null : shownTriplet(explanation?.triads[candidate] ?? null);
  const select = (side: Side, key: string | null): void => setSelected(key === null ? null : { side, key });
  const lookAt = (place: Place | null): void => {
    const centre = centreOf(place);
    if (centre === null) return;
    const partner = partnerOf(scene, centre);
    const places = { [centre.side]: centre.pixel, ...(partner === null ? {} : { [partner.side]: partner.pixel }) };
    show(centred(view, places["left"] ?? null, places["right"] ?? null, Math.max(CLOSE_ZOOM, whole.zoom)));
  };
  const lookAtCandidate = (index: number): void => {
    const wanted = shownTriplet(explanation?.triads[index] ?? null);
    setCandidate(index);
    if (wanted === null) return;
    show(centred(view, middleOf(wanted, scene, "left"), middleOf(wanted, scene, "right"), Math.max(CLOSE_ZOOM, whole.zoom)));
  };
  const choose = (side: Side, key: string): void => {
    select(side, key);
    if (moved !== null) lookAt({ side, key });
  };

  const canEdit = props.editing && !props.isSaving && !sending;
  const edit = (next: Edit): void => {
    setProblem(null);
    if (canEdit) props.onDraft(appended(draft, next));
  };
  const actionsOf = (side: Side): ViewerActions => ({
    show,
    fit: () => setMoved(null),
    frame,
    centre: () => lookAt(selected),
    select: (key) => select(side, key),
    step: (by) => {
      const current = selected?.side === side ? selected.key : null;
      const next = stepped(visibleCentres(scene, side, layers, null, null, current), current, by);
      if (next !== null) select(side, next);
    },
    move: (key, to) => {
      select(side, key);
      edit({ kind: "move", side, key, to: [rounded(to[0]), rounded(to[1])] });
    },
    nudge: (by) => {
      if (chosen?.side !== side || !isMovable(chosen)) return;
      const to: Vec2 = [rounded(chosen.pixel[0] + by[0]), rounded(chosen.pixel[1] + by[1])];
      edit({ kind: "move", side, key: chosen.key, to });
    },
    remove: () => {
      if (chosen?.side === side && isMovable(chosen)) edit({ kind: "remove-centre", side, key: chosen.key });
    },
    add: (at) => {
      const key = nextKey(draft);
      edit({ kind: "add", side, key, at: [rounded(at[0]), rounded(at[1])] });
      select(side, key);
      setAdding(false);
    },
  });

  const save = async (): Promise<void> => {
    const body = revisionOf(scene, pair);
    if (body === null) return;
    setSending(true);
    setProblem(null);
    try {
      const take = await send<Stage>("POST", `${stage}/revisions`, body);
      props.onSaved(take.job.id, take.take);
    } catch (error) {
      setProblem(asProblem(error));
    }
    refresh(stage);
    setSending(false);
  };
  const newer = props.counted !== null && props.counted.take > shown.take && !props.isSaving ? props.counted : null;
  const isConflict = newer !== null && draft.count > 0;
  const onKeyDown = (event: KeyboardEvent): void => {
    const next = canEdit ? afterUndoKey(event, draft) : null;
    if (next === null) return;
    event.preventDefault();
    props.onDraft(next);
  };

  return (
    <div class="images-work" onKeyDown={onKeyDown}>
      <div class="stack">
        <section class="panel stack" aria-labelledby="images-heading">
          <h2 id="images-heading" class="visually-hidden">
            Both images
          </h2>
          <Toolbar
            zoom={view.zoom}
            onZoom={(by) => show(zoomed(view, size, by, [size[0] / 2, size[1] / 2], whole.zoom))}
            onFit={() => setMoved(null)}
            onFrame={frame}
            contrast={gray.contrast}
            plain={gray.plain}
            onContrast={gray.change}
            layers={layers}
            onLayers={setLayers}
            ellipseFactor={factor}
          />
          <div class="viewers">
            {SIDES.map((side) => (
              <Viewer
                {...(side === "left" ? { box } : {})}
                side={side}
                view={view}
                size={size}
                leastZoom={whole.zoom}
                scene={scene}
                camera={rig[side]}
                ballDiameterMm={state.ballDiameterMm}
                layers={layers}
                ellipseFactor={factor}
                selected={selected?.side === side ? selected.key : null}
                active={active}
                epipolar={epipolar}
                triplet={triplet}
                discarded={explanation?.[side].discarded ?? []}
                shifts={state.comparison?.shifts ?? []}
                picture={pictures[side]}
                source={gray.sources[side]}
                download={imagePath(side)}
                editing={canEdit}
                adding={adding}
                actions={actionsOf(side)}
                onFocus={(key) => select(side, key)}
                onHover={(key) => setHovered(key === null ? null : { side, key })}
              />
            ))}
            <ViewerHelp editing={props.editing} />
          </div>
        </section>
        <FoundTabs
          state={state}
          explanation={explanation}
          takes={props.takes}
          counted={props.counted}
          shown={shown}
          compared={props.compared}
          editing={props.editing}
          tab={tab}
          selected={selected}
          candidate={candidate}
          onTab={(key) => {
            setTab(key);
            setCandidate(null);
          }}
          onSelect={choose}
          onHover={setHovered}
          onCandidate={setCandidate}
          onLook={lookAtCandidate}
          onShow={props.onShow}
          onCompare={props.onCompare}
        />
      </div>
      <div class="images-side stack">
        {props.notice}
        {isConflict && newer !== null && (
          <ConflictNotice
            draft={draft}
            scene={state.base}
            newer={newer}
            pair={pair}
            onCarry={(next) => props.onCarry(next, newer.take)}
            onDiscard={props.onLeave}
          />
        )}
        <SelectionPanel
          scene={scene}
          centre={chosen}
          rig={rig}
          epipolar={chosenEpipolar}
          sources={gray.sources}
          vertebrae={surgery.vertebrae}
          editing={canEdit}
          onEdit={edit}
          onSelect={choose}
        />
        {props.editing && (
          <CorrectionPanel
            draft={draft}
            changes={changesOf(state.base, scene)}
            wrong={wrongWith(scene)}
            blocked={isConflict}
            nextTake={(props.takes[0]?.take ?? shown.take) + 1}
            adding={adding}
            saving={!canEdit}
            problem={isConflict ? null : problem}
            onAdding={setAdding}
            onUndo={() => props.onDraft(undone(draft))}
            onRedo={() => props.onDraft(redone(draft))}
            onSave={() => void save()}
            onLeave={props.onLeave}
          />
        )}
      </div>
    </div>
  );
}

/** The key of the mark after, or before, the current one; the first, or the last, without one. */
function stepped(centres: readonly Centre[], current: string | null, by: 1 | -1): string | null {
  const at = centres.findIndex((centre) => centre.key === current);
  const next = at < 0 ? (by > 0 ? 0 : centres.length - 1) : (at + by + centres.length) % centres.length;
  return centres[next]?.key ?? null;
}

/** Whether a centre can be edited: it is a feature of this pair, or new. */
function isMovable(centre: Centre): boolean {
  return !centre.key.startsWith("b");
}

/** Hundredths of a pixel are finer than anybody can place a centre. */
function rounded(value: number): number {
  return Math.round(value * 100) / 100;
}
