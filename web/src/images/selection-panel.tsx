/** The chosen ball: magnified in both images, its numbers, and what can be corrected of it and its triad. */
import type { VNode } from "preact";

import { fixed } from "../format/numbers";
import { Quantity } from "../format/quantity";
import type { Rig, Side } from "./camera";
import { type Edit, type EditedScene, placeOf } from "./draft";
import { intersect } from "./epipolar";
import { distanceToLine, type EpipolarView } from "./epipolar-view";
import { Magnifier } from "./magnifier";
import { FEATURE_REASONS } from "./reasons";
import { ballOf, type Centre, centreAt, centreName, deviations, partnerOf, type SceneTriad, triadName } from "./scene";

interface SelectionPanelProps {
  scene: EditedScene;
  centre: Centre | null;
  rig: Rig;
  epipolar: EpipolarView | null;
  sources: Readonly<Record<Side, HTMLCanvasElement | null>>;
  vertebrae: readonly string[];
  editing: boolean;
  onEdit: (edit: Edit) => void;
  onSelect: (side: Side, key: string) => void;
}

/** The panel beside the images. */
export function SelectionPanel(props: SelectionPanelProps): VNode {
  const { scene, centre, epipolar, sources, editing, onEdit } = props;
  if (centre === null) {
    return (
      <section class="panel selection" aria-labelledby="selection-heading">
        <h2 id="selection-heading" tabIndex={-1}>No ball chosen</h2>
        <p class="muted small">
          Choose a ball in an image or in the table: it is magnified here, and its epipolar line is drawn in the other image.
        </p>
      </section>
    );
  }
  const partner = partnerOf(scene, centre);
  const bySide = { [centre.side]: centre, [partner?.side ?? "none"]: partner } as Partial<Record<Side, Centre | null>>;
  const triad = centre.triad === null ? undefined : scene.triads[centre.triad];
  const isRemoved = scene.removedCentres.has(placeOf(centre.side, centre.key));
  return (
    <section class="panel selection stack" aria-labelledby="selection-heading">
      <header>
        <h2 id="selection-heading" tabIndex={-1}>{centreName(scene, centre)}</h2>
        <span class="muted">{centre.side} image</span>
      </header>
      <div class="magnifiers">
        <Magnifier side="left" centre={bySide.left ?? null} source={sources.left} epipolar={epipolar} />
        <Magnifier side="right" centre={bySide.right ?? null} source={sources.right} epipolar={epipolar} />
      </div>
      <Place centre={centre} editing={editing && centre.ball !== null ? !centre.key.startsWith("b") : editing} onEdit={onEdit} />
      <Facts {...props} centre={centre} partner={partner} />
      {editing && !centre.key.startsWith("b") && (
        <div class="row">
          <button
            type="button"
            class="button button-small"
            disabled={isRemoved}
            onClick={() => onEdit({ kind: "remove-centre", side: centre.side, key: centre.key })}
          >
            Remove this ball centre
          </button>
        </div>
      )}
      {triad !== undefined && <TriadPart {...props} triad={triad} />}
    </section>
  );
}

function Place({ centre, editing, onEdit }: { centre: Centre; editing: boolean; onEdit: (edit: Edit) => void }): VNode {
  if (!editing) return <></>;
  const input = (axis: 0 | 1): VNode => (
    <label class="field place">
      <span class="label">{axis === 0 ? "u (to the right), px" : "v (downwards), px"}</span>
      <input
        type="number"
        step="0.1"
        value={centre.pixel[axis].toFixed(2)}
        onChange={(event) => {
          const value = event.currentTarget.valueAsNumber;
          if (!Number.isFinite(value)) return;
          const to = axis === 0 ? ([value, centre.pixel[1]] as const) : ([centre.pixel[0], value] as const);
          onEdit({ kind: "move", side: centre.side, key: centre.key, to });
        }}
      />
    </label>
  );
  return (
    <div class="places">
      {input(0)}
      {input(1)}
      <p class="small muted">
        On its mark: <kbd>arrows</kbd> move by 0.1 px, with <kbd>shift</kbd> by 1 px.
      </p>
    </div>
  );
}

function Facts({ scene, centre, partner, rig, epipolar, onSelect }: SelectionPanelProps & { centre: Centre; partner: Centre | null }): VNode {
  const sd = deviations(centre);
  const [left, right] = centre.side === "left" ? [centre, partner] : [partner, centre];
  const meeting = left === null || right === null ? null : intersect(rig, left.pixel, right.pixel);
  const measured = ballOf(scene, centre)?.parallaxMm ?? null;
  const isEdited = [left, right].some((one) => one !== null && scene.editedCentres.has(placeOf(one.side, one.key)));
  const candidates = (epipolar?.candidates ?? []).flatMap((key) => centreAt(scene, epipolar?.side ?? "left", key) ?? []);
  return (
    <dl class="ball-facts">
      <dt>Centre</dt>
      <dd>
        u <Quantity value={centre.pixel[0]} sd={sd?.[0]} unit="px" digits={2} />, v{" "}
        <Quantity value={centre.pixel[1]} sd={sd?.[1]} unit="px" digits={2} />
      </dd>
      <dt>From</dt>
      <dd>
        {centre.manual ? "a person" : "detection"}
        {centre.score !== null && `, score ${fixed(centre.score, 2)} (0 to 1)`}
      </dd>
      {centre.reason !== null && (
        <>
          <dt>No ball, because</dt>
          <dd>{FEATURE_REASONS[centre.reason]}</dd>
        </>
      )}
      {centre.triad !== null && (
        <>
          <dt>Parallax</dt>
          <dd>
            <Quantity value={isEdited ? (meeting?.parallaxMm ?? null) : measured} unit="mm" digits={2} reason="one image shows the ball" />
            {isEdited && <span class="muted"> from the centres as edited; {measured === null ? "none" : `${fixed(measured, 2)} mm`} before</span>}
          </dd>
          <dt>From epipolar line</dt>
          <dd>
            <Quantity value={distanceToLine(epipolar, partner)} unit="px" digits={2} reason="hidden in the other image" />
            <span class="muted"> in the {centre.side === "left" ? "right" : "left"} image</span>
          </dd>
        </>
      )}
      <dt>Candidates</dt>
      <dd class="candidates">
        {candidates.length === 0 && <span class="muted">none on its epipolar line</span>}
        {candidates.map((candidate) => (
          <button type="button" class="link-button" onClick={() => onSelect(candidate.side, candidate.key)}>
            {centreName(scene, candidate)}
          </button>
        ))}
      </dd>
    </dl>
  );
}

function TriadPart({ scene, triad, vertebrae, editing, onEdit }: SelectionPanelProps & { triad: SceneTriad }): VNode {
  const isRemoved = scene.removedTriads.has(triad.index);
  return (
    <div class="triad-part stack">
      <h3>Triad {triadName(triad)}</h3>
      {triad.label === null && triad.labelReason !== null && <p class="small muted">No label: {triad.labelReason}</p>}
      {triad.reason !== null && <p class="small muted">No pose: {triad.reason}</p>}
      {triad.position !== null && (
        <p class="small muted">
          P {(["X", "Y", "Z"] as const).map((axis, k) => (
            <>
              {axis} <Quantity value={triad.position?.[k]} sd={triad.positionSd?.[k]} unit="mm" digits={2} />{" "}
            </>
          ))}
          in object space
        </p>
      )}
      {editing && (
        <div class="row">
          <label class="field triad-label-field">
            <span class="label">Label</span>
            <select
              aria-label="Label of the triad"
              value={triad.label ?? ""}
              disabled={isRemoved}
              onChange={(event) => onEdit({ kind: "label", triad: triad.index, label: event.currentTarget.value || null })}
            >
              <option value="">no label</option>
              {vertebrae.map((vertebra) => (
                <option value={vertebra}>{vertebra}</option>
              ))}
            </select>
          </label>
          <button
            type="button"
            class="button button-small"
            disabled={isRemoved || triad.label === null || triad.labelManual}
            onClick={() => onEdit({ kind: "label", triad: triad.index, label: triad.label })}
          >
            {triad.labelManual ? "Confirmed" : "Confirm label"}
          </button>
          <button
            type="button"
            class="button button-small"
            disabled={isRemoved}
            onClick={() => onEdit({ kind: "remove-triad", triad: triad.index })}
          >
            Remove triad
          </button>
        </div>
      )}
    </div>
  );
}
