/** A canvas that shows part of a picture through a window of gray levels. */
import type { VNode } from "preact";
import { useEffect, useMemo, useRef } from "preact/hooks";

import { type Picture, shown, type Window } from "./levels";
import type { Vec2 } from "./vectors";

/** Zoom from which single pixels are shown as squares. */
const SQUARES_ZOOM = 3;

interface PictureCanvasProps {
  source: HTMLCanvasElement | null;
  /** Screen px per image px, and the pixel in the middle. */
  zoom: number;
  centre: Vec2;
  /** Width and height, screen px. */
  size: Vec2;
  label: string;
}

/** A canvas with a picture's gray levels through a window, one pixel each; null without a picture. */
export function usePictureCanvas(picture: Picture | null, window: Window | null): HTMLCanvasElement | null {
  return useMemo(() => {
    if (picture === null || window === null) return null;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.width, picture.height];
    canvas.getContext("2d")?.putImageData(new ImageData(shown(picture, window), picture.width, picture.height), 0, 0);
    return canvas;
  }, [picture, window?.black, window?.white]);
}

/** Part of a picture. */
export function PictureCanvas({ source, zoom, centre, size, label }: PictureCanvasProps): VNode {
  const canvas = useRef<HTMLCanvasElement>(null);
  const ratio = globalThis.devicePixelRatio || 1;
  const [width, height] = [Math.max(1, Math.round(size[0] * ratio)), Math.max(1, Math.round(size[1] * ratio))];
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!context) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    if (source === null) return;
    const scale = zoom * ratio;
    // A whole number is the centre of a pixel, whose corner is half a pixel up and left.
    context.setTransform(scale, 0, 0, scale, width / 2 - (centre[0] + 0.5) * scale, height / 2 - (centre[1] + 0.5) * scale);
    context.imageSmoothingEnabled = zoom < SQUARES_ZOOM;
    context.imageSmoothingQuality = "high";
    context.drawImage(source, 0, 0);
  }, [source, zoom, centre[0], centre[1], width, height, ratio]);
  return (
    <canvas
      ref={canvas}
      width={width}
      height={height}
      role="img"
      aria-label={label}
      style={{ width: `${size[0]}px`, height: `${size[1]}px` }}
    />
  );
}
