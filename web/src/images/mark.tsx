/** The mark of one ball centre over an image. */
import type { VNode } from "preact";

import type { EditedScene } from "./draft";
import { ellipse95 } from "./ellipses";
import { triadLook } from "./looks";
import { type Centre, centreName, deviations, placeInSpine } from "./scene";
import type { Vec2 } from "./vectors";

interface MarkProps {
  centre: Centre;
  scene: EditedScene;
  /** Screen px. */
  place: Vec2;
  /** Screen px per image px. */
  zoom: number;
  /** Factor by which its ellipse is enlarged; null for no ellipse. */
  ellipseFactor: number | null;
  isTabStop: boolean;
  isSelected: boolean;
  isActive: boolean;
  isCandidate: boolean;
  isEdited: boolean;
  isRemoved: boolean;
  onFocus: (key: string) => void;
  onHover: (key: string | null) => void;
}

/** A cross at the centre with its ellipse; rings tell the chosen one, and candidates of the epipolar band. */
export function Mark(props: MarkProps): VNode {
  const { centre, scene, place, zoom, ellipseFactor } = props;
  const [x, y] = place;
  const ellipse = ellipseFactor === null || centre.covariance === null ? null : ellipse95(centre.covariance);
  const isBall = centre.triad !== null;
  const names = ["mark", isBall ? `ball ${colourOf(scene, centre)}` : "feature"];
  if (props.isActive) names.push("is-active");
  if (props.isCandidate) names.push("is-candidate");
  if (props.isRemoved) names.push("is-removed");
  return (
    <g
      class={names.join(" ")}
      role="button"
      tabIndex={props.isTabStop ? 0 : -1}
      aria-pressed={props.isSelected}
      aria-label={markLabel(scene, centre, props)}
      data-key={centre.key}
      data-x={x}
      data-y={y}
      transform={`translate(${x.toFixed(2)} ${y.toFixed(2)})`}
      onFocus={() => props.onFocus(centre.key)}
      onPointerEnter={() => props.onHover(centre.key)}
      onPointerLeave={() => props.onHover(null)}
    >
      <circle class="hit" r="12" />
      {ellipse !== null && ellipseFactor !== null && (
        <ellipse
          class="deviation"
          rx={ellipse.a * zoom * ellipseFactor}
          ry={ellipse.b * zoom * ellipseFactor}
          transform={`rotate(${ellipse.angleDeg.toFixed(1)})`}
        />
      )}
      {isBall ? <path class="cross" d="M-6 0H-2M2 0H6M0 -6V-2M0 2V6" /> : <circle class="dot" r="3.5" />}
      {props.isCandidate && <circle class="candidate-ring" r="9" />}
      {(centre.manual || props.isEdited) && <path class="manual" d="M0 -11L11 0L0 11L-11 0Z" />}
      {props.isRemoved && <path class="removed" d="M-8 -8L8 8M8 -8L-8 8" />}
      {props.isActive && <circle class="ring" r="14" />}
    </g>
  );
}

function colourOf(scene: EditedScene, centre: Centre): string {
  const triad = centre.triad === null ? undefined : scene.triads[centre.triad];
  return triad === undefined ? "" : `triad-colour-${triadLook(placeInSpine(scene, triad)).colour}`;
}

function markLabel(scene: EditedScene, centre: Centre, state: Pick<MarkProps, "isEdited" | "isRemoved">): string {
  const sd = deviations(centre);
  const parts = [
    `${centreName(scene, centre)}, ${centre.side} image`,
    `u ${centre.pixel[0].toFixed(1)}, v ${centre.pixel[1].toFixed(1)} px`,
  ];
  if (sd !== null) parts.push(`deviations ${sd[0].toFixed(2)} and ${sd[1].toFixed(2)} px`);
  if (state.isRemoved) parts.push("removed in this correction");
  else if (state.isEdited) parts.push("edited in this correction");
  else if (centre.manual) parts.push("placed by a person");
  return parts.join("; ");
}
