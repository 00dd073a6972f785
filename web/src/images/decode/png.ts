/** PNG files of 16 bits per sample, which browsers reduce to 8. */
import type { Picture } from "../levels";
import { DAMAGED, inflate, luma, PictureError } from "./parts";

const SIGNATURE = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
const DEPTH_BYTE = 24;
/** Samples of a pixel by colour type: gray, RGB, gray with alpha, RGB with alpha. */
const SAMPLES: Readonly<Record<number, number>> = { 0: 1, 2: 3, 4: 2, 6: 4 };
/** First column and row, and steps, of the seven passes of an interlaced file. */
const ADAM7 = [
  [0, 0, 8, 8],
  [4, 0, 8, 8],
  [0, 4, 4, 8],
  [2, 0, 4, 4],
  [0, 2, 2, 4],
  [1, 0, 2, 2],
  [0, 1, 1, 2],
] as const;

/** Whether a file is a PNG with 16 bits per sample. */
export function isPng16(bytes: Uint8Array): boolean {
  return SIGNATURE.every((byte, k) => bytes[k] === byte) && bytes[DEPTH_BYTE] === 16;
}

/** The gray levels of a PNG with 16 bits per sample; colour becomes luma, transparency is ignored. */
export async function decodePng16(bytes: Uint8Array<ArrayBuffer>): Promise<Picture> {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  const samples = SAMPLES[view.getUint8(25)];
  if (samples === undefined || width === 0 || height === 0) throw new PictureError(DAMAGED);
  const passes = view.getUint8(28) === 1 ? ADAM7 : ([[0, 0, 1, 1]] as const);
  const pixelBytes = samples * 2;
  const sizes = passes.map(([u0, v0, du, dv]) => {
    const size = { width: Math.ceil((width - u0) / du), height: Math.ceil((height - v0) / dv) };
    return size.width > 0 && size.height > 0 ? size : { width: 0, height: 0 };
  });
  const length = sizes.reduce((sum, size) => sum + size.height * (1 + size.width * pixelBytes), 0);
  const data = await inflate(compressed(bytes, view), length);
  const levels = new Uint16Array(width * height);
  let start = 0;
  passes.forEach(([u0, v0, du, dv], pass) => {
    const size = sizes[pass] ?? { width: 0, height: 0 };
    const stride = 1 + size.width * pixelBytes;
    for (let row = 0; row < size.height; row++) {
      unfilter(data, start + row * stride, stride, pixelBytes, row > 0);
      const first = start + row * stride + 1;
      for (let column = 0; column < size.width; column++) {
        levels[(v0 + row * dv) * width + u0 + column * du] = level(data, first + column * pixelBytes, samples);
      }
    }
    start += size.height * stride;
  });
  return { width, height, levels, bits: 16 };
}

/** The contents of all IDAT chunks. */
function compressed(bytes: Uint8Array, view: DataView): Uint8Array<ArrayBuffer> {
  const parts: Uint8Array[] = [];
  let position = SIGNATURE.length;
  while (position + 8 <= bytes.length) {
    const length = view.getUint32(position);
    if (view.getUint32(position + 4) === 0x49444154) parts.push(bytes.subarray(position + 8, position + 8 + length));
    position += 12 + length;
  }
  const joined = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let end = 0;
  for (const part of parts) {
    joined.set(part, end);
    end += part.length;
  }
  return joined;
}

/** Undo the filter of a row in place; its first byte names the filter. */
function unfilter(data: Uint8Array, start: number, stride: number, pixelBytes: number, hasAbove: boolean): void {
  const filter = data[start];
  if (filter === 0) return;
  for (let k = 1; k < stride; k++) {
    const at = start + k;
    const left = k > pixelBytes ? (data[at - pixelBytes] ?? 0) : 0;
    const above = hasAbove ? (data[at - stride] ?? 0) : 0;
    const corner = hasAbove && k > pixelBytes ? (data[at - stride - pixelBytes] ?? 0) : 0;
    data[at] = (data[at] ?? 0) + predicted(filter, left, above, corner);
  }
}

function predicted(filter: number | undefined, left: number, above: number, corner: number): number {
  if (filter === 1) return left;
  if (filter === 2) return above;
  if (filter === 3) return (left + above) >> 1;
  if (filter !== 4) throw new PictureError(DAMAGED);
  const estimate = left + above - corner;
  const [dl, da, dc] = [Math.abs(estimate - left), Math.abs(estimate - above), Math.abs(estimate - corner)];
  if (dl <= da && dl <= dc) return left;
  return da <= dc ? above : corner;
}

function level(data: Uint8Array, at: number, samples: number): number {
  const sample = (k: number): number => ((data[at + 2 * k] ?? 0) << 8) | (data[at + 2 * k + 1] ?? 0);
  return samples < 3 ? sample(0) : luma(sample(0), sample(1), sample(2));
}
