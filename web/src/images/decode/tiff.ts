/** TIFF files as cameras and image programs write them: gray or colour, 8 or 16 bits, in strips or tiles. */
import type { Picture } from "../levels";
import { luma, PictureError } from "./parts";
import { segmentDecoder } from "./tiff-compression";
import { readDirectory, type TiffDirectory } from "./tiff-directory";

const WHITE_IS_ZERO = 0;
const RGB = 2;
const PALETTE = 3;
const TOO_SPECIAL = "This kind of TIFF cannot be shown here. Download it to look at it.";

/** Whether a file is a TIFF, or a BigTIFF. */
export function isTiff(bytes: Uint8Array): boolean {
  const [a, b, c, d] = bytes;
  return (a === 0x49 && b === 0x49 && (c === 42 || c === 43) && d === 0) || (a === 0x4d && b === 0x4d && c === 0 && (d === 42 || d === 43));
}

/** The gray levels of a TIFF as stored; colour becomes luma, and an orientation tag is ignored. */
export async function decodeTiff(bytes: Uint8Array<ArrayBuffer>): Promise<Picture> {
  const tiff = readDirectory(bytes);
  requireShowable(tiff);
  const decode = segmentDecoder(tiff.compression);
  if (decode === null) throw new PictureError(TOO_SPECIAL);
  const levels = tiff.bits === 16 ? new Uint16Array(tiff.width * tiff.height) : new Uint8Array(tiff.width * tiff.height);
  const across = Math.ceil(tiff.width / tiff.segmentWidth);
  const sampleBytes = tiff.bits / 8;
  const pixelBytes = tiff.samples * sampleBytes;
  for (let k = 0; k < tiff.offsets.length; k++) {
    const [u0, v0] = [(k % across) * tiff.segmentWidth, Math.floor(k / across) * tiff.segmentHeight];
    const rows = tiff.isTiled ? tiff.segmentHeight : Math.min(tiff.segmentHeight, tiff.height - v0);
    if (rows <= 0) break;
    const start = tiff.offsets[k] ?? 0;
    const stored = bytes.slice(start, start + (tiff.sizes[k] ?? 0));
    const data = await decode(stored, rows * tiff.segmentWidth * pixelBytes);
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    if (tiff.predictor === 2) undoDifferences(view, tiff, rows);
    for (let row = 0; row < Math.min(rows, tiff.height - v0); row++) {
      for (let column = 0; column < Math.min(tiff.segmentWidth, tiff.width - u0); column++) {
        const at = (row * tiff.segmentWidth + column) * pixelBytes;
        levels[(v0 + row) * tiff.width + u0 + column] = grayAt(view, at, tiff);
      }
    }
  }
  return { width: tiff.width, height: tiff.height, levels, bits: tiff.bits === 16 ? 16 : 8 };
}

function requireShowable(tiff: TiffDirectory): void {
  const isGray = tiff.photometric <= 1;
  const isColour = tiff.photometric === RGB && tiff.samples >= 3;
  const isPalette = tiff.photometric === PALETTE && tiff.bits === 8 && tiff.palette !== null;
  const isPlain = tiff.predictor <= 2 && (tiff.planar === 1 || tiff.samples === 1) && tiff.sampleFormat === 1;
  if ((tiff.bits !== 8 && tiff.bits !== 16) || !isPlain || !(isGray || isColour || isPalette)) {
    throw new PictureError(TOO_SPECIAL);
  }
}

function undoDifferences(view: DataView, tiff: TiffDirectory, rows: number): void {
  const { samples, littleEndian } = tiff;
  const perRow = tiff.segmentWidth * samples;
  for (let row = 0; row < rows; row++) {
    for (let k = samples; k < perRow; k++) {
      const at = row * perRow + k;
      if (tiff.bits === 8) view.setUint8(at, view.getUint8(at) + view.getUint8(at - samples));
      else {
        const sum = view.getUint16(2 * at, littleEndian) + view.getUint16(2 * (at - samples), littleEndian);
        view.setUint16(2 * at, sum, littleEndian);
      }
    }
  }
}

function grayAt(view: DataView, at: number, tiff: TiffDirectory): number {
  const sample = (k: number): number =>
    tiff.bits === 16 ? view.getUint16(at + 2 * k, tiff.littleEndian) : view.getUint8(at + k);
  if (tiff.photometric === RGB) return luma(sample(0), sample(1), sample(2));
  if (tiff.photometric === PALETTE && tiff.palette !== null) {
    const entries = tiff.palette.length / 3;
    const [red, green, blue] = [0, 1, 2].map((k) => (tiff.palette?.[k * entries + sample(0)] ?? 0) >> 8);
    return luma(red ?? 0, green ?? 0, blue ?? 0);
  }
  return tiff.photometric === WHITE_IS_ZERO ? 2 ** tiff.bits - 1 - sample(0) : sample(0);
}
