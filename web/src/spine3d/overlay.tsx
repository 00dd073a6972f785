/** What lies over the picture as text and lines: names of vertebrae, gaps, directions, scale. */
import type { Signal } from "@preact/signals";
import type { VNode } from "preact";

import { fixed } from "../format/numbers";
import { StatusMark } from "../format/status-mark";
import { AXIS_COLOURS } from "./appearance";
import { type Body, type Gap, runName } from "./bodies";
import { labelColumn, type LabelPlace } from "./labels";
import { dot } from "./vectors";
import { basisOf, DIRECTIONS, edgeNames, project, scaleBar, type Screen, type View, viewInWords } from "./views";

interface OverlayProps {
  view: Signal<View | null>;
  screen: Signal<Screen>;
  bodies: readonly Body[];
  gaps: readonly Gap[];
  /** All that is drawn: the labels are beside it. */
  shown: readonly Body[];
  planShiftMm: number;
  selected: string | null;
  onSelect: (level: string) => void;
}

const COLUMN_PX = 172;
const BESIDE_PX = 80;
const EDGE_PX = 28;

export function Overlay({ view, screen, bodies, gaps, shown, planShiftMm, selected, onSelect }: OverlayProps): VNode | null {
  if (view.value === null) return null;
  const [now, size] = [view.value, screen.value];
  const shiftPx = (planShiftMm * size.height) / now.height;
  const anchors = [
    ...bodies.map((body) => ({ key: body.level, ...project(now, size, body.position) })),
    ...gaps.map((gap) => ({ key: gapKey(gap), ...project(now, size, gap.position) })),
  ].filter(({ x, y }) => x > 0 && y > 0 && x < size.width && y < size.height);
  const places = labelColumn(anchors, {
    spacing: 21,
    top: EDGE_PX + 12,
    bottom: size.height - EDGE_PX - 12,
    x: Math.min(size.width - COLUMN_PX, BESIDE_PX + Math.max(...shown.map(({ position }) => project(now, size, position).x)) + shiftPx),
  });
  const levels = new Map(bodies.map((body) => [body.level, body]));
  const edges = edgeNames(now);
  return (
    <>
      <svg class="spine-lines" width={size.width} height={size.height} aria-hidden="true">
        {places.map((place) => (
          <Leader place={place} isSelected={place.key === selected} isGap={!levels.has(place.key)} />
        ))}
        <Directions view={now} screen={size} />
      </svg>
      <div class="spine-labels" aria-hidden="true">
        {places.map(({ key, at }) => {
          const body = levels.get(key);
          const style = { transform: `translate(${at[0]}px, ${at[1]}px) translateY(-50%)` };
          if (body === undefined) {
            return (
              <span class="spine-label spine-gap" style={style} key={key}>
                {key} <span class="spine-gap-note">not measured</span>
              </span>
            );
          }
          return (
            <span
              class={`spine-label${key === selected ? " spine-label-selected" : ""}`}
              style={style}
              key={key}
              onPointerDown={(event) => event.stopPropagation()}
              onClick={() => onSelect(key)}
            >
              <StatusMark status={body.status} />
              {key}
            </span>
          );
        })}
        {(["left", "right", "top", "bottom"] as const).map((side) => (
          <span class={`spine-edge spine-edge-${side}`}>{edges[side]}</span>
        ))}
      </div>
      <p class="spine-caption" aria-hidden="true">
        {viewInWords(now)}
      </p>
      <ScaleBar view={now} screen={size} />
    </>
  );
}

function gapKey(gap: Gap): string {
  return runName(gap.levels);
}

function Leader({ place, isSelected, isGap }: { place: LabelPlace; isSelected: boolean; isGap: boolean }): VNode {
  const [[x0, y0], [x1, y1]] = [place.from, place.at];
  const elbow = x1 - 14;
  const r = 5;
  return (
    <g
      class={`spine-leader${isSelected ? " spine-leader-selected" : isGap ? " spine-leader-gap" : ""}`}
      data-vertebra={place.key}
    >
      <path d={`M${x0} ${y0}L${elbow} ${y1}H${x1 - 5}`} />
      {isGap ? (
        <path class="spine-cross" d={`M${x0 - r} ${y0 - r}L${x0 + r} ${y0 + r}M${x0 + r} ${y0 - r}L${x0 - r} ${y0 + r}`} />
      ) : (
        <circle cx={x0} cy={y0} r="2.2" />
      )}
    </g>
  );
}

const ARM_PX = 40;

/** The patient's directions as arrows in the corner; those that point at the viewer or away have no room for a name. */
function Directions({ view, screen }: { view: View; screen: Screen }): VNode {
  const { right, up, toward } = basisOf(view);
  const [x0, y0] = [74, screen.height - 74];
  const axes = DIRECTIONS.filter((_, k) => k % 2 === 0)
    .map(({ name, axis }, k) => ({
      name,
      colour: `var(${AXIS_COLOURS[k] ?? "--text"})`,
      x: x0 + ARM_PX * dot(axis, right),
      y: y0 - ARM_PX * dot(axis, up),
      depth: dot(axis, toward),
    }))
    .sort((a, b) => a.depth - b.depth);
  return (
    <g class="spine-directions">
      {axes.map(({ name, colour, x, y, depth }) => {
        const isSeen = Math.abs(depth) < 0.96;
        const [dx, dy] = [(x - x0) / ARM_PX, (y - y0) / ARM_PX];
        return (
          <g stroke={colour} fill={colour} key={name}>
            <path d={`M${x0} ${y0}L${x} ${y}`} />
            <circle cx={x} cy={y} r="3" />
            {isSeen && (
              <text x={x + 10 * dx} y={y + 12 * dy + 4} text-anchor={dx > 0.35 ? "start" : dx < -0.35 ? "end" : "middle"}>
                {name}
              </text>
            )}
          </g>
        );
      })}
    </g>
  );
}

function ScaleBar({ view, screen }: { view: View; screen: Screen }): VNode {
  const { mm, px } = scaleBar(view, screen);
  return (
    <div class="spine-scale" aria-hidden="true">
      <span class="spine-scale-bar" style={{ width: `${px}px` }} />
      <span>{fixed(mm, 0)} mm</span>
    </div>
  );
}
