/** What all decoders of images need. */

/** An image file that cannot be shown here, with a sentence that says what to do. */
export class PictureError extends Error {
  override readonly name = "PictureError";
}

export const DAMAGED = "The image file is damaged or incomplete. Download it to look at it.";

/** Luma of BT.601, as the measurement computes it. */
export function luma(red: number, green: number, blue: number): number {
  return Math.round(0.299 * red + 0.587 * green + 0.114 * blue);
}

/** Decompress zlib data; whatever follows the stream is left out. */
export async function inflate(bytes: Uint8Array<ArrayBuffer>, length: number): Promise<Uint8Array> {
  const out = new Uint8Array(length);
  let position = 0;
  try {
    const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
    while (position < length) {
      const { done, value } = await reader.read();
      if (done) break;
      out.set(value.subarray(0, length - position), position);
      position += value.length;
    }
    await reader.cancel();
  } catch {
    // Data behind the stream are an error to the browser, not to the image: what counts is whether it is complete.
  }
  if (position < length) throw new PictureError(DAMAGED);
  return out;
}
