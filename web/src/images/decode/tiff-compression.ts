/** Compressions of TIFF strips and tiles. */
import { DAMAGED, inflate, PictureError } from "./parts";

export type SegmentDecoder = (stored: Uint8Array<ArrayBuffer>, length: number) => Promise<Uint8Array>;

const CLEAR = 256;
const END = 257;
const MAX_CODES = 4096;

/** The decoder of a compression; null for one that cannot be shown. */
export function segmentDecoder(compression: number): SegmentDecoder | null {
  if (compression === 1) return async (stored, length) => complete(stored, length);
  if (compression === 5) return async (stored, length) => unpackLzw(stored, length);
  if (compression === 8 || compression === 32946) return inflate;
  if (compression === 32773) return async (stored, length) => unpackBits(stored, length);
  return null;
}

/** PackBits: runs of a byte, and copies. */
export function unpackBits(packed: Uint8Array, length: number): Uint8Array {
  const out = new Uint8Array(length);
  let end = 0;
  let k = 0;
  while (k < packed.length && end < length) {
    const count = ((packed[k++] ?? 0) << 24) >> 24;
    if (count >= 0) {
      const part = packed.subarray(k, Math.min(k + count + 1, k + length - end));
      out.set(part, end);
      end += part.length;
      k += count + 1;
    } else if (count > -128) {
      out.fill(packed[k++] ?? 0, end, Math.min(length, end + 1 - count));
      end = Math.min(length, end + 1 - count);
    }
  }
  if (end < length) throw new PictureError(DAMAGED);
  return out;
}

/** LZW of TIFF 6.0: codes of 9 to 12 bits, most significant bit first, each width one code early. */
export function unpackLzw(packed: Uint8Array, length: number): Uint8Array {
  const out = new Uint8Array(length);
  // A code is a place in the output: what it stands for is written there already.
  const starts = new Int32Array(MAX_CODES + 1);
  const lengths = new Int32Array(MAX_CODES + 1);
  let [next, width, end, previous] = [END + 1, 9, 0, -1];
  let [held, bits] = [0, 0];
  for (const byte of packed) {
    held = ((held << 8) | byte) & 0xffffff;
    bits += 8;
    if (bits < width) continue;
    bits -= width;
    const code = (held >> bits) & ((1 << width) - 1);
    if (code === END || end >= length) break;
    if (code === CLEAR) {
      [next, width, previous] = [END + 1, 9, -1];
      continue;
    }
    const before: number = end;
    if (code < CLEAR) out[end++] = code;
    else if (code < next || (code === next && previous >= 0)) {
      const isNew = code === next;
      const [start, count] = isNew
        ? [starts[MAX_CODES] ?? 0, (lengths[MAX_CODES] ?? 0) + 1]
        : [starts[code] ?? 0, lengths[code] ?? 0];
      for (let k = 0; k < count && end < length; k++) out[end++] = out[start + k] ?? 0;
    } else throw new PictureError(DAMAGED);
    if (previous >= 0 && next < MAX_CODES) {
      starts[next] = starts[MAX_CODES] ?? 0;
      lengths[next] = (lengths[MAX_CODES] ?? 0) + 1;
      next++;
    }
    // The last entry remembers what the previous code stood for.
    starts[MAX_CODES] = before;
    lengths[MAX_CODES] = end - before;
    previous = code;
    if (next >= (1 << width) - 1 && width < 12) width++;
  }
  return complete(out.subarray(0, end), length);
}

function complete(data: Uint8Array, length: number): Uint8Array {
  if (data.length < length) throw new PictureError(DAMAGED);
  return data.subarray(0, length);
}
