/** A ball centre and its surroundings, eight times enlarged. */
import type { VNode } from "preact";

import { ellipse95 } from "./ellipses";
import type { EpipolarView } from "./epipolar-view";
import { pointsText } from "./looks";
import { PictureCanvas } from "./picture-canvas";
import type { Side } from "./camera";
import type { Centre } from "./scene";
import type { Vec2 } from "./vectors";

const ZOOM = 8;
const SIZE: Vec2 = [184, 152];

interface MagnifierProps {
  side: Side;
  centre: Centre | null;
  source: HTMLCanvasElement | null;
  /** Drawn when it lies in this image. */
  epipolar: EpipolarView | null;
}

/** One image around a centre; empty where the ball is hidden. */
export function Magnifier({ side, centre, source, epipolar }: MagnifierProps): VNode {
  const name = side === "left" ? "Left" : "Right";
  return (
    <figure class="magnifier">
      <figcaption class="small muted">
        {name} image, {ZOOM}×
      </figcaption>
      {centre === null ? (
        <p class="muted small">no centre in this image</p>
      ) : (
        <div>
          <PictureCanvas
            source={source}
            zoom={ZOOM}
            centre={centre.pixel}
            size={SIZE}
            label={`${name} image around u ${centre.pixel[0].toFixed(1)}, v ${centre.pixel[1].toFixed(1)} px, ${ZOOM} times enlarged`}
          />
          <Reticle centre={centre} epipolar={epipolar?.side === side ? epipolar : null} />
        </div>
      )}
    </figure>
  );
}

function Reticle({ centre, epipolar }: { centre: Centre; epipolar: EpipolarView | null }): VNode {
  const [x, y] = [SIZE[0] / 2, SIZE[1] / 2];
  const ellipse = centre.covariance === null ? null : ellipse95(centre.covariance);
  const line = epipolar?.line.map(
    (point): Vec2 => [(point[0] - centre.pixel[0]) * ZOOM + x, (point[1] - centre.pixel[1]) * ZOOM + y],
  );
  return (
    <svg width={SIZE[0]} height={SIZE[1]} aria-hidden="true" class="reticle">
      {line !== undefined && <polyline class="epipolar-line" points={pointsText(line)} />}
      <path class="halo" d={`M${x} 0V${y - 6}M${x} ${y + 6}V${SIZE[1]}M0 ${y}H${x - 6}M${x + 6} ${y}H${SIZE[0]}`} />
      <path d={`M${x} 0V${y - 6}M${x} ${y + 6}V${SIZE[1]}M0 ${y}H${x - 6}M${x + 6} ${y}H${SIZE[0]}`} />
      {ellipse !== null && (
        <ellipse
          rx={ellipse.a * ZOOM}
          ry={ellipse.b * ZOOM}
          transform={`translate(${x} ${y}) rotate(${ellipse.angleDeg.toFixed(1)})`}
        />
      )}
    </svg>
  );
}
