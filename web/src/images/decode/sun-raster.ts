/** Sun rasters of 8, 24 and 32 bits per pixel, the format of the cart of 1995. */
import type { Picture } from "../levels";
import { DAMAGED, luma, PictureError } from "./parts";

const MAGIC = 0x59a66a95;
const HEADER_BYTES = 32;
const RUN_LENGTHS = 2;
const RGB_ORDER = 3;
const ESCAPE = 0x80;

/** Whether a file is a Sun raster. */
export function isSunRaster(bytes: Uint8Array): boolean {
  return bytes.length >= HEADER_BYTES && dataView(bytes).getUint32(0) === MAGIC;
}

/** The gray levels of a Sun raster; colour becomes luma. */
export function decodeSunRaster(bytes: Uint8Array): Picture {
  const view = dataView(bytes);
  const [width, height, depth, , kind, , mapBytes] = [4, 8, 12, 16, 20, 24, 28].map((at) => view.getUint32(at)) as [
    number, number, number, number, number, number, number,
  ];
  if (depth !== 8 && depth !== 24 && depth !== 32) {
    throw new PictureError(`A Sun raster of ${depth} bits per pixel cannot be shown. Download it to look at it.`);
  }
  const row = (width * depth) / 8;
  const stored = bytes.subarray(HEADER_BYTES + mapBytes);
  const padded = row + (row % 2);
  const data = kind === RUN_LENGTHS ? unpack(stored, padded * height) : stored;
  // Rows are padded to 16 bits; some writers leave the padding out of packed rows.
  const stride = data.length === row * height ? row : padded;
  if (data.length < stride * (height - 1) + row) throw new PictureError(DAMAGED);
  const grays = mapBytes > 0 ? mapped(bytes.subarray(HEADER_BYTES, HEADER_BYTES + mapBytes)) : null;
  const pixelBytes = depth / 8;
  const skipped = depth === 32 ? 1 : 0;
  const levels = new Uint8Array(width * height);
  for (let v = 0; v < height; v++) {
    for (let u = 0; u < width; u++) {
      const at = v * stride + u * pixelBytes + skipped;
      const [a, b, c] = [data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0];
      if (depth === 8) levels[v * width + u] = grays === null ? a : (grays[a] ?? 0);
      else levels[v * width + u] = kind === RGB_ORDER ? luma(a, b, c) : luma(c, b, a);
    }
  }
  return { width, height, levels, bits: 8 };
}

/** The gray of each entry of a colour map, which has all reds first, then greens, then blues. */
function mapped(map: Uint8Array): Uint8Array {
  const entries = Math.floor(map.length / 3);
  return Uint8Array.from({ length: entries }, (_, k) =>
    luma(map[k] ?? 0, map[entries + k] ?? 0, map[2 * entries + k] ?? 0),
  );
}

function unpack(packed: Uint8Array, limit: number): Uint8Array {
  const out = new Uint8Array(limit);
  let end = 0;
  for (let k = 0; k < packed.length && end < limit; k++) {
    const byte = packed[k] ?? 0;
    if (byte !== ESCAPE) {
      out[end++] = byte;
      continue;
    }
    const count = packed[++k] ?? 0;
    if (count === 0) {
      out[end++] = ESCAPE;
      continue;
    }
    const next = Math.min(limit, end + count + 1);
    out.fill(packed[++k] ?? 0, end, next);
    end = next;
  }
  return out.subarray(0, end);
}

function dataView(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}
