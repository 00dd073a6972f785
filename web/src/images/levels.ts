/** Gray levels on the screen: a window of the levels of an image, by brightness and contrast. */

/** Gray levels of an image, row by row. */
export interface Picture {
  width: number;
  height: number;
  levels: Uint8Array | Uint16Array;
  /** Bits of a level: 8 or 16. */
  bits: 8 | 16;
}

/** The levels shown as black and as white. */
export interface Window {
  black: number;
  white: number;
}

export interface Contrast {
  /** -1 to 1: part of the window by which the picture is brightened. */
  brightness: number;
  /** 1 for the levels as they are; 2 shows half as many. */
  contrast: number;
  /** Whether the window starts from the levels that occur, or from all that are possible. */
  stretched: boolean;
}

export const PLAIN: Contrast = { brightness: 0, contrast: 1, stretched: false };

/** Share of the pixels that may be darker than black, and brighter than white, in a stretched window. */
const CLIPPED_SHARE = 0.002;

/** The window of all levels that are possible. */
export function fullWindow(picture: Picture): Window {
  return { black: 0, white: 2 ** picture.bits - 1 };
}

/** The window of the levels that occur, without the few darkest and brightest pixels. */
export function stretchedWindow(picture: Picture): Window {
  const counts = new Uint32Array(2 ** picture.bits);
  for (const level of picture.levels) counts[level] = (counts[level] ?? 0) + 1;
  const clipped = picture.levels.length * CLIPPED_SHARE;
  const black = levelAfter(counts, clipped, 0, 1);
  const white = levelAfter(counts, clipped, counts.length - 1, -1);
  return white > black ? { black, white } : fullWindow(picture);
}

/** A window made brighter and of more contrast. */
export function adjusted(window: Window, { brightness, contrast }: Contrast): Window {
  const width = window.white - window.black;
  const middle = (window.white + window.black) / 2 - brightness * width;
  return { black: middle - width / contrast / 2, white: middle + width / contrast / 2 };
}

/** The gray on the screen, 0 to 255, of every level. */
export function lookup(window: Window, bits: 8 | 16): Uint8ClampedArray {
  const table = new Uint8ClampedArray(2 ** bits);
  const width = Math.max(window.white - window.black, 1e-9);
  for (let level = 0; level < table.length; level++) table[level] = ((level - window.black) / width) * 255;
  return table;
}

/** The pixels RGBA of a picture through a window. */
export function shown(picture: Picture, window: Window): Uint8ClampedArray<ArrayBuffer> {
  const table = lookup(window, picture.bits);
  const rgba = new Uint8ClampedArray(new ArrayBuffer(picture.levels.length * 4));
  const pixels = new Uint32Array(rgba.buffer);
  picture.levels.forEach((level, k) => {
    // Gray is the same in every byte order but for the opaque alpha, which is the last byte in memory.
    pixels[k] = ((table[level] ?? 0) * 0x00010101) | 0xff000000;
  });
  return rgba;
}

function levelAfter(counts: Uint32Array, pixels: number, start: number, step: 1 | -1): number {
  let seen = 0;
  for (let level = start; level >= 0 && level < counts.length; level += step) {
    seen += counts[level] ?? 0;
    if (seen > pixels) return level;
  }
  return start;
}
