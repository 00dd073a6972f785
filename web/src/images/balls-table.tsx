/** The balls of all triads as a table: the same data as over the images, for reading and copying. */
import type { VNode } from "preact";

import { Quantity } from "../format/quantity";
import type { Side } from "./camera";
import { type EditedScene, placeOf } from "./draft";
import { triadLook } from "./looks";
import { type Centre, centreAt, deviations, placeInSpine, type SceneTriad, type TriadBall, triadName } from "./scene";

interface BallsTableProps {
  scene: EditedScene;
  selected: { side: Side; key: string } | null;
  onSelect: (side: Side, key: string) => void;
  onHover: (place: { side: Side; key: string } | null) => void;
}

const ONE_RAY = "one image shows the ball, so that its rays have no distance";
const AFTER_SAVING = "computed again when the correction is saved";

/** One row for each ball. */
export function BallsTable(props: BallsTableProps): VNode {
  const { scene } = props;
  if (scene.triads.length === 0) return <p class="empty">No triads were found in these images.</p>;
  return (
    <div class="scroll-x">
      <table class="balls">
        <caption>
          Ball centres (u to the right, v downwards, px; 0 is the centre of the first pixel) ± one standard deviation.
        </caption>
        <thead>
          <tr>
            <th scope="col">Triad</th>
            <th scope="col">Ball</th>
            <th scope="col" class="number">Left u</th>
            <th scope="col" class="number">Left v</th>
            <th scope="col" class="number">Right u</th>
            <th scope="col" class="number">Right v</th>
            <th scope="col" class="number">Parallax</th>
            <th scope="col">By</th>
          </tr>
        </thead>
        <tbody>{scene.triads.map((triad) => triad.balls.map((ball, k) => <Row {...props} triad={triad} ball={ball} isFirst={k === 0} />))}</tbody>
      </table>
    </div>
  );
}

function Row({ scene, triad, ball, isFirst, selected, onSelect, onHover }: BallsTableProps & { triad: SceneTriad; ball: TriadBall; isFirst: boolean }): VNode {
  const left = centreAt(scene, "left", ball.left);
  const right = centreAt(scene, "right", ball.right);
  const shown = left ?? right;
  const isSelected = selected !== null && ball[selected.side] === selected.key;
  const isEdited = [left, right].some((centre) => centre !== null && scene.editedCentres.has(placeOf(centre.side, centre.key)));
  const hover = (): void => onHover(shown === null ? null : { side: shown.side, key: shown.key });
  return (
    <tr class={isSelected ? "is-selected" : ""} onPointerEnter={hover} onPointerLeave={() => onHover(null)}>
      {isFirst && (
        <th scope="rowgroup" rowSpan={triad.balls.length} class="triad-cell">
          <span class={`swatch triad-colour-${triadLook(placeInSpine(scene, triad)).colour}`} aria-hidden="true" />
          {triadName(triad)}
          <TriadState scene={scene} triad={triad} />
        </th>
      )}
      <td>
        <button
          type="button"
          class="link-button"
          disabled={shown === null}
          aria-label={`Show ball ${ball.name} of ${triadName(triad)}`}
          onClick={() => shown !== null && onSelect(shown.side, shown.key)}
          onFocus={hover}
          onBlur={() => onHover(null)}
        >
          {ball.name}
        </button>
      </td>
      <Coordinates centre={left} />
      <Coordinates centre={right} />
      <td class="number">
        <Quantity value={isEdited ? null : ball.parallaxMm} unit="mm" digits={2} reason={isEdited ? AFTER_SAVING : ONE_RAY} />
      </td>
      <td class="small">{byWhom(scene, left, right)}</td>
    </tr>
  );
}

function Coordinates({ centre }: { centre: Centre | null }): VNode {
  const sd = centre === null ? null : deviations(centre);
  return (
    <>
      {[0, 1].map((k) => (
        <td class="number">
          <Quantity value={centre?.pixel[k]} sd={sd?.[k]} unit="px" digits={2} reason="hidden in this image" />
        </td>
      ))}
    </>
  );
}

function TriadState({ scene, triad }: { scene: EditedScene; triad: SceneTriad }): VNode | null {
  if (scene.removedTriads.has(triad.index)) return <span class="small muted block">removed in this correction</span>;
  if (scene.editedLabels.has(triad.index)) return <span class="small muted block">label edited in this correction</span>;
  if (triad.labelManual) return <span class="small muted block">label by a person</span>;
  return triad.label === null ? <span class="small muted block">{triad.labelReason}</span> : null;
}

function byWhom(scene: EditedScene, left: Centre | null, right: Centre | null): string {
  const centres = [left, right].filter((centre): centre is Centre => centre !== null);
  const edited = centres.filter((centre) => scene.editedCentres.has(placeOf(centre.side, centre.key)));
  const removed = centres.filter((centre) => scene.removedCentres.has(placeOf(centre.side, centre.key)));
  if (removed.length > 0) return `removed: ${removed.map((centre) => centre.side).join(", ")}`;
  if (edited.length > 0) return `edited: ${edited.map((centre) => centre.side).join(", ")}`;
  const manual = centres.filter((centre) => centre.manual);
  return manual.length === 0 ? "detection" : `a person: ${manual.map((centre) => centre.side).join(", ")}`;
}
