/** A part of a radiograph at a multiple of its size, with a reticle. */
import type { VNode } from "preact";

import type { Band } from "./geometry";
import type { Point } from "./landmarks";
import type { Size } from "./viewport";

const SIDE = 150;
const SCALE = 5;

interface MagnifierProps {
  source: string;
  size: Size;
  centre: Point;
  filter: string;
  band: Band | null;
}

/** What lies around a place, five times as large as its pixels. */
export function Magnifier({ source, size, centre: [u, v], filter, band }: MagnifierProps): VNode {
  const x = SIDE / 2 - SCALE * (u + 0.5);
  const y = SIDE / 2 - SCALE * (v + 0.5);
  const bandY = band === null ? null : SIDE / 2 + SCALE * (band.v - v);
  return (
    <div class="magnifier" aria-hidden="true">
      <img
        src={source}
        alt=""
        draggable={false}
        style={{
          filter,
          width: `${size.width}px`,
          height: `${size.height}px`,
          transform: `translate(${x}px, ${y}px) scale(${SCALE})`,
        }}
      />
      <svg width={SIDE} height={SIDE}>
        {band !== null && bandY !== null && (
          <rect class="band" x={0} y={bandY - SCALE * band.halfWidth} width={SIDE} height={2 * SCALE * band.halfWidth} />
        )}
        <path d={`M0 ${SIDE / 2}h${SIDE / 2 - 6}M${SIDE / 2 + 6} ${SIDE / 2}h${SIDE}M${SIDE / 2} 0v${SIDE / 2 - 6}M${SIDE / 2} ${SIDE / 2 + 6}v${SIDE}`} />
      </svg>
    </div>
  );
}
