/** A marker from above, with the distances between its balls. */
import type { VNode } from "preact";

import type { AccuracyPlan } from "../api/types";
import { fixed } from "../format/numbers";

const SIDE = 170;

/** The marker of a design. */
export function MarkerDrawing({ name, marker }: { name: string; marker: AccuracyPlan["marker"] }): VNode {
  const reach = Math.max(...marker.coordinates_mm.map(([x = 0, y = 0]) => Math.hypot(x, y))) + marker.ball_diameter_mm;
  const scale = SIDE / 2 / reach;
  const balls = marker.coordinates_mm.map(([x = 0, y = 0]) => ({ x: SIDE / 2 + scale * x, y: SIDE / 2 - scale * y }));
  return (
    <figure class="marker-drawing">
      <figcaption class="small muted">
        Marker {name}: {marker.distances_mm.map((distance) => fixed(distance, 1)).join(", ")} mm apart
      </figcaption>
      <svg viewBox={`0 0 ${SIDE} ${SIDE}`} width={SIDE} height={SIDE} role="img" aria-label={`Marker of design ${name} from above, x to the right`}>
        {balls.map(({ x, y }) => <line x1={SIDE / 2} y1={SIDE / 2} x2={x} y2={y} />)}
        {balls.map(({ x, y }, index) => (
          <g>
            <circle cx={x} cy={y} r={(scale * marker.ball_diameter_mm) / 2} />
            <text x={x} y={y}>{marker.balls[index]}</text>
          </g>
        ))}
        <circle class="marker-p" cx={SIDE / 2} cy={SIDE / 2} r={2.5} />
      </svg>
    </figure>
  );
}
