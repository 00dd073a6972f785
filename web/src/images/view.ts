/** What part of both images is shown: zoom and centres, linked so that both views move alike. */
import type { Side } from "./camera";
import type { Vec2 } from "./vectors";

export interface View {
  /** Screen px per image px, the same in both views. */
  zoom: number;
  /** Pixel in the middle of each view. */
  left: Vec2;
  right: Vec2;
}

/** Width and height, screen px. */
export type ViewSize = Vec2;

export const MAX_ZOOM = 64;

/** Image px around what is framed. */
const FRAME_PX = 24;

/** The zoom at which an image just fits into a view. */
export function fittingZoom(size: ViewSize, image: Vec2): number {
  return Math.min(size[0] / image[0], size[1] / image[1]);
}

/** The view that shows both images whole. */
export function fitted(size: ViewSize, left: Vec2, right: Vec2): View {
  return {
    zoom: Math.min(fittingZoom(size, left), fittingZoom(size, right)),
    left: middleOf(left),
    right: middleOf(right),
  };
}

/** Zoom by a factor about a place of the view, screen px from its upper left corner. */
export function zoomed(view: View, size: ViewSize, factor: number, at: Vec2, leastZoom: number): View {
  const zoom = Math.min(MAX_ZOOM, Math.max(leastZoom, view.zoom * factor));
  const change = 1 / view.zoom - 1 / zoom;
  const shift: Vec2 = [(at[0] - size[0] / 2) * change, (at[1] - size[1] / 2) * change];
  return { zoom, left: moved(view.left, shift), right: moved(view.right, shift) };
}

/** Move the images under the view by screen px. */
export function panned(view: View, byScreen: Vec2): View {
  const shift: Vec2 = [-byScreen[0] / view.zoom, -byScreen[1] / view.zoom];
  return { ...view, left: moved(view.left, shift), right: moved(view.right, shift) };
}

/** Show a place of each image in the middle; null leaves that view where it is. */
export function centred(view: View, left: Vec2 | null, right: Vec2 | null, leastZoom: number): View {
  return { zoom: Math.max(view.zoom, leastZoom), left: left ?? view.left, right: right ?? view.right };
}

/** The view in which given places of both images are as large as both views can show them; null without places. */
export function framed(size: ViewSize, left: readonly Vec2[], right: readonly Vec2[], leastZoom: number): View | null {
  const boxes = { left: boxOf(left), right: boxOf(right) };
  const zooms = [boxes.left, boxes.right].flatMap((box) =>
    box === null ? [] : [size[0] / (box.width + 2 * FRAME_PX), size[1] / (box.height + 2 * FRAME_PX)],
  );
  if (boxes.left === null || boxes.right === null) return null;
  const zoom = Math.min(MAX_ZOOM, Math.max(leastZoom, Math.min(...zooms)));
  return { zoom, left: boxes.left.middle, right: boxes.right.middle };
}

/** Keep the middle of each view inside its image. */
export function kept(view: View, left: Vec2, right: Vec2): View {
  return { ...view, left: inside(view.left, left), right: inside(view.right, right) };
}

/** The place on the screen of a pixel. */
export function toScreen(view: View, size: ViewSize, side: Side, pixel: Vec2): Vec2 {
  const centre = view[side];
  return [(pixel[0] - centre[0]) * view.zoom + size[0] / 2, (pixel[1] - centre[1]) * view.zoom + size[1] / 2];
}

/** The pixel at a place on the screen. */
export function toPixel(view: View, size: ViewSize, side: Side, at: Vec2): Vec2 {
  const centre = view[side];
  return [(at[0] - size[0] / 2) / view.zoom + centre[0], (at[1] - size[1] / 2) / view.zoom + centre[1]];
}

function boxOf(places: readonly Vec2[]): { width: number; height: number; middle: Vec2 } | null {
  if (places.length === 0) return null;
  const [us, vs] = [places.map((place) => place[0]), places.map((place) => place[1])];
  const [u0, u1, v0, v1] = [Math.min(...us), Math.max(...us), Math.min(...vs), Math.max(...vs)];
  return { width: u1 - u0, height: v1 - v0, middle: [(u0 + u1) / 2, (v0 + v1) / 2] };
}

function middleOf(image: Vec2): Vec2 {
  return [(image[0] - 1) / 2, (image[1] - 1) / 2];
}

function moved(centre: Vec2, shift: Vec2): Vec2 {
  return [centre[0] + shift[0], centre[1] + shift[1]];
}

function inside(centre: Vec2, image: Vec2): Vec2 {
  return [Math.min(image[0] - 1, Math.max(0, centre[0])), Math.min(image[1] - 1, Math.max(0, centre[1]))];
}
