/** The part of an image that is shown: screen = scale * image + offset, in CSS pixels. */
import type { Point } from "./landmarks";

export interface Size {
  readonly width: number;
  readonly height: number;
}

export interface Viewport {
  readonly scale: number;
  readonly x: number;
  readonly y: number;
}

export const MAX_SCALE = 24;
const FIT_MARGIN = 0.98;

/** The viewport that shows a whole image in the middle of a window. */
export function fit(image: Size, window: Size): Viewport {
  if (image.width <= 0 || image.height <= 0) return { scale: 1, x: 0, y: 0 };
  const scale = FIT_MARGIN * Math.min(window.width / image.width, window.height / image.height);
  return { scale, x: (window.width - scale * image.width) / 2, y: (window.height - scale * image.height) / 2 };
}

/** Where a place of the image appears; an integer is the centre of a pixel. */
export function toScreen(view: Viewport, [u, v]: Point): Point {
  return [view.x + view.scale * (u + 0.5), view.y + view.scale * (v + 0.5)];
}

/** Which place of the image appears at a place of the window. */
export function toImage(view: Viewport, [x, y]: Point): Point {
  return [(x - view.x) / view.scale - 0.5, (y - view.y) / view.scale - 0.5];
}

/** The viewport after zooming by a factor about a place of the window, not beyond limits. */
export function zoomed(view: Viewport, factor: number, [x, y]: Point, image: Size, window: Size): Viewport {
  const least = fit(image, window).scale / 2;
  const scale = Math.min(MAX_SCALE, Math.max(least, view.scale * factor));
  const ratio = scale / view.scale;
  return { scale, x: x - ratio * (x - view.x), y: y - ratio * (y - view.y) };
}

/** The viewport moved by some CSS pixels. */
export function panned(view: Viewport, dx: number, dy: number): Viewport {
  return { ...view, x: view.x + dx, y: view.y + dy };
}

/** The viewport, moved only if necessary, that shows a place at least a margin inside the window. */
export function revealed(view: Viewport, point: Point, window: Size): Viewport {
  const [x, y] = toScreen(view, point);
  const margin = Math.min(60, window.width / 4, window.height / 4);
  const dx = Math.max(0, margin - x) - Math.max(0, x - (window.width - margin));
  const dy = Math.max(0, margin - y) - Math.max(0, y - (window.height - margin));
  return dx === 0 && dy === 0 ? view : panned(view, dx, dy);
}
