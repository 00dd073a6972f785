/** What is drawn over one image, in screen px: triads, balls, features, epipolar line, candidates. */
import type { VNode } from "preact";

import type { DiscardedCandidate } from "../api/types";
import type { Camera, Side } from "./camera";
import type { BallShift } from "./comparison";
import { type EditedScene, placeOf } from "./draft";
import { ballOutline } from "./ellipses";
import type { EpipolarView } from "./epipolar-view";
import { type Layers, pointsText, triadLook } from "./looks";
import { Mark } from "./mark";
import { type Centre, centreAt, partnerOf, placeInSpine, type SceneTriad, triadName } from "./scene";
import { distance2, type Vec2 } from "./vectors";
import { toScreen, type View, type ViewSize } from "./view";

/** Movement of a ball centre between takes that is none, px. */
const UNMOVED_PX = 0.01;

/** Features of a candidate triad in both images, by the keys of their centres. */
export interface ShownTriplet {
  left: readonly (string | null)[];
  right: readonly (string | null)[];
  balls: readonly string[];
  chosen: boolean;
}

export interface OverlayProps {
  side: Side;
  view: View;
  size: ViewSize;
  scene: EditedScene;
  camera: Camera;
  ballDiameterMm: number;
  layers: Layers;
  /** Factor by which ellipses are enlarged. */
  ellipseFactor: number;
  selected: string | null;
  active: Centre | null;
  epipolar: EpipolarView | null;
  triplet: ShownTriplet | null;
  discarded: readonly DiscardedCandidate[];
  shifts: readonly BallShift[];
  onFocus: (key: string) => void;
  onHover: (key: string | null) => void;
}

/** Everything over one image. */
export function Overlay(props: OverlayProps): VNode {
  const { side, view, size, scene, layers, epipolar, triplet, shifts, discarded } = props;
  const place = (pixel: Vec2): Vec2 => toScreen(view, size, side, pixel);
  const centres = visibleCentres(scene, side, layers, epipolar, triplet, props.selected);
  const tabStop = tabStopOf(props, centres);
  return (
    <svg class="overlay" width={size[0]} height={size[1]} role="group" aria-label={`Marks over the ${side} image`}>
      {epipolar?.side === side && <EpipolarBand view={epipolar} place={place} zoom={view.zoom} />}
      {layers.discarded && <Discarded candidates={discarded} place={place} />}
      {scene.triads.map((triad) => (
        <TriadLines {...props} triad={triad} place={place} />
      ))}
      <Shifts shifts={shifts.filter((shift) => shift.side === side)} place={place} />
      {triplet !== null && <Triplet triplet={triplet} scene={scene} side={side} place={place} />}
      {centres.map((centre) => (
        <Mark
          key={centre.key}
          centre={centre}
          scene={scene}
          place={place(centre.pixel)}
          zoom={view.zoom}
          ellipseFactor={layers.ellipses && centre.triad !== null ? props.ellipseFactor : null}
          isTabStop={centre.key === tabStop}
          isSelected={centre.key === props.selected}
          isActive={props.active?.side === side && props.active.key === centre.key}
          isCandidate={epipolar?.side === side && epipolar.candidates.includes(centre.key)}
          isEdited={scene.editedCentres.has(placeOf(side, centre.key))}
          isRemoved={scene.removedCentres.has(placeOf(side, centre.key)) || isOfRemovedTriad(scene, centre)}
          onFocus={props.onFocus}
          onHover={props.onHover}
        />
      ))}
      {layers.labels && scene.triads.map((triad) => <TriadLabel scene={scene} side={side} triad={triad} place={place} />)}
    </svg>
  );
}

/** The mark that the Tab key reaches: the chosen ball, its partner in the other image, or the first. */
function tabStopOf({ scene, side, selected, active }: OverlayProps, centres: readonly Centre[]): string | null {
  const partner = active === null || active.side === side ? null : partnerOf(scene, active);
  const wanted = selected ?? partner?.key;
  return centres.find((centre) => centre.key === wanted)?.key ?? centres[0]?.key ?? null;
}

/** The centres that are shown, those of triads first and in their order. */
export function visibleCentres(
  scene: EditedScene,
  side: Side,
  layers: Layers,
  epipolar: EpipolarView | null,
  triplet: ShownTriplet | null,
  selected: string | null,
): Centre[] {
  const wanted = new Set([...(epipolar?.side === side ? epipolar.candidates : []), ...(triplet?.[side] ?? []), selected]);
  const others = scene[side].filter(
    (centre) =>
      centre.triad === null &&
      (layers.features || wanted.has(centre.key) || centre.manual || scene.removedCentres.has(placeOf(side, centre.key))),
  );
  const balls = scene.triads.flatMap((triad) => triad.balls.flatMap((ball) => centreAt(scene, side, ball[side]) ?? []));
  return [...balls, ...others];
}

interface Placed {
  place: (pixel: Vec2) => Vec2;
}

function EpipolarBand({ view, place, zoom }: Placed & { view: EpipolarView; zoom: number }): VNode {
  const points = pointsText(view.line.map(place));
  return (
    <g class="epipolar">
      <polyline class="epipolar-band" points={points} stroke-width={Math.max(2, 2 * view.halfWidth * zoom)} />
      <polyline class="epipolar-line" points={points} data-line={pointsText(view.line)} />
    </g>
  );
}

function Discarded({ candidates, place }: Placed & { candidates: readonly DiscardedCandidate[] }): VNode {
  return (
    <g class="discarded">
      {candidates.map((candidate) => {
        const [x, y] = place([candidate.x, candidate.y]);
        return <path d={`M${x - 3} ${y - 3}l6 6m0 -6l-6 6`} />;
      })}
    </g>
  );
}

function TriadLines(props: OverlayProps & Placed & { triad: SceneTriad }): VNode | null {
  const { side, scene, triad, layers, place } = props;
  const look = triadLook(placeInSpine(scene, triad));
  const centres = triad.balls.flatMap((ball) => centreAt(scene, side, ball[side]) ?? []);
  const removed = scene.removedTriads.has(triad.index) ? " is-removed" : "";
  return (
    <g class={`triad triad-colour-${look.colour}${removed}`} data-triad={triad.index}>
      {layers.outlines &&
        triad.balls.map((ball) => {
          const key = ball[side];
          if (key === null || scene.editedCentres.has(placeOf(side, key))) return null;
          const outline = ballOutline(props.camera, ball.position, props.ballDiameterMm);
          return outline.length === 0 ? null : <polygon class="outline" points={pointsText(outline.map(place))} />;
        })}
      {layers.triads && centres.length > 1 && (
        <>
          <polygon class="halo" points={pointsText(centres.map((centre) => place(centre.pixel)))} />
          <polygon class="legs" points={pointsText(centres.map((centre) => place(centre.pixel)))} stroke-dasharray={look.dash} />
        </>
      )}
    </g>
  );
}

function TriadLabel({ scene, side, triad, place }: Placed & { scene: EditedScene; side: Side; triad: SceneTriad }): VNode | null {
  const places = triad.balls.flatMap((ball) => {
    const centre = centreAt(scene, side, ball[side]);
    return centre === null ? [] : [place(centre.pixel)];
  });
  if (places.length === 0) return null;
  const x = places.reduce((sum, at) => sum + at[0], 0) / places.length;
  const y = Math.min(...places.map((at) => at[1])) - 16;
  const isRemoved = scene.removedTriads.has(triad.index);
  const isEdited = triad.labelManual || scene.editedLabels.has(triad.index);
  return (
    <text class={`triad-label triad-colour-${triadLook(placeInSpine(scene, triad)).colour}${isRemoved ? " is-removed" : ""}`} x={x} y={y}>
      {triad.label ?? `no label (${triadName(triad)})`}
      {isEdited && !isRemoved && " ✎"}
      {isRemoved && " removed"}
    </text>
  );
}

function Triplet({ triplet, scene, side, place }: Placed & { triplet: ShownTriplet; scene: EditedScene; side: Side }): VNode {
  const places = triplet[side].map((key) => {
    const centre = centreAt(scene, side, key);
    return centre === null ? null : place(centre.pixel);
  });
  const shown = places.filter((at): at is Vec2 => at !== null);
  return (
    <g class={triplet.chosen ? "triplet is-chosen" : "triplet"}>
      <polygon class="halo" points={pointsText(shown)} />
      <polygon points={pointsText(shown)} />
      {places.map(
        (at, k) =>
          at !== null && (
            <text x={at[0] + 8} y={at[1] + 14}>
              {triplet.balls[k]}
            </text>
          ),
      )}
    </g>
  );
}

function Shifts({ shifts, place }: Placed & { shifts: readonly BallShift[] }): VNode {
  return (
    <g class="shifts">
      {shifts.filter(isSeen).map((shift) => {
        const [x, y] = place(shift.then);
        const end = shift.now === null ? null : place(shift.now);
        return (
          <>
            <rect x={x - 9} y={y - 9} width="18" height="18" />
            {end !== null && <line x1={x} y1={y} x2={end[0]} y2={end[1]} />}
          </>
        );
      })}
    </g>
  );
}

/** Whether a ball is elsewhere than in the earlier take. */
function isSeen(shift: BallShift): boolean {
  return shift.now === null || distance2(shift.then, shift.now) > UNMOVED_PX;
}

function isOfRemovedTriad(scene: EditedScene, centre: Centre): boolean {
  return centre.triad !== null && scene.removedTriads.has(centre.triad);
}
