/** The directory of a TIFF file: how its pixels are stored. */
import { DAMAGED, PictureError } from "./parts";

export interface TiffDirectory {
  littleEndian: boolean;
  width: number;
  height: number;
  /** Bits of a sample, the same for all. */
  bits: number;
  samples: number;
  /** Kind of numbers: 1 is an unsigned integer. */
  sampleFormat: number;
  /** 0 white is zero, 1 black is zero, 2 RGB, 3 palette. */
  photometric: number;
  compression: number;
  predictor: number;
  /** 1: the samples of a pixel are together. */
  planar: number;
  isTiled: boolean;
  /** Size of a strip or a tile. */
  segmentWidth: number;
  segmentHeight: number;
  offsets: readonly number[];
  sizes: readonly number[];
  /** Reds, greens and blues of a palette, 16 bits each. */
  palette: readonly number[] | null;
}

const TYPE_BYTES: Readonly<Record<number, number>> = { 1: 1, 3: 2, 4: 4, 16: 8 };
const MAX_VALUES = 100_000;

/** Read the first directory of a TIFF or BigTIFF. */
export function readDirectory(bytes: Uint8Array): TiffDirectory {
  try {
    return directory(new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength));
  } catch (error) {
    if (error instanceof RangeError) throw new PictureError(DAMAGED);
    throw error;
  }
}

function directory(view: DataView): TiffDirectory {
  const littleEndian = view.getUint8(0) === 0x49;
  const isBig = view.getUint16(2, littleEndian) === 43;
  const offsetBytes = isBig ? 8 : 4;
  const integer = (at: number, size: number): number => {
    if (size === 1) return view.getUint8(at);
    if (size === 2) return view.getUint16(at, littleEndian);
    return size === 4 ? view.getUint32(at, littleEndian) : Number(view.getBigUint64(at, littleEndian));
  };
  const start = integer(isBig ? 8 : 4, offsetBytes);
  const entries = integer(start, isBig ? 8 : 2);
  const first = start + (isBig ? 8 : 2);
  const entryBytes = 4 + 2 * offsetBytes;
  const tags = new Map<number, number[]>();
  for (let k = 0; k < Math.min(entries, 256); k++) {
    const at = first + k * entryBytes;
    const size = TYPE_BYTES[integer(at + 2, 2)];
    const count = integer(at + 4, offsetBytes);
    if (size === undefined || count > MAX_VALUES) continue;
    const valueAt = at + 4 + offsetBytes;
    const place = size * count <= offsetBytes ? valueAt : integer(valueAt, offsetBytes);
    tags.set(integer(at, 2), Array.from({ length: count }, (_, n) => integer(place + n * size, size)));
  }
  return described(littleEndian, tags);
}

function described(littleEndian: boolean, tags: ReadonlyMap<number, number[]>): TiffDirectory {
  const value = (tag: number, otherwise: number): number => tags.get(tag)?.[0] ?? otherwise;
  const [width, height] = [value(256, 0), value(257, 0)];
  const isTiled = tags.has(322);
  const offsets = tags.get(isTiled ? 324 : 273) ?? [];
  const sizes = tags.get(isTiled ? 325 : 279) ?? [];
  if (width === 0 || height === 0 || offsets.length === 0 || sizes.length !== offsets.length) {
    throw new PictureError(DAMAGED);
  }
  const bits = tags.get(258) ?? [1];
  return {
    littleEndian,
    width,
    height,
    bits: bits.every((number) => number === bits[0]) ? (bits[0] ?? 0) : 0,
    samples: value(277, 1),
    sampleFormat: value(339, 1),
    photometric: value(262, 1),
    compression: value(259, 1),
    predictor: value(317, 1),
    planar: value(284, 1),
    isTiled,
    segmentWidth: isTiled ? value(322, width) : width,
    segmentHeight: isTiled ? value(323, height) : Math.min(value(278, height), height),
    offsets,
    sizes,
    palette: tags.get(320) ?? null,
  };
}
