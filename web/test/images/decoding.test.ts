import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";

import { PictureError } from "../../src/images/decode/parts";
import { decodePicture } from "../../src/images/decode/picture";
import { unpackBits, unpackLzw } from "../../src/images/decode/tiff-compression";

interface Example {
  name: string;
  file: string;
  width: number;
  height: number;
  bits: 8 | 16;
  levels: string;
}

// Files and the gray levels that the Python library reads in them; tests/dashboard/test_images.py reads them again.
const examples: Example[] = JSON.parse(readFileSync("test/images/samples.json", "utf8"));
const bytesOf = (base64: string): Uint8Array<ArrayBuffer> => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));

describe("an image file", () => {
  for (const example of examples) {
    it(`has the gray levels that the measurement reads: ${example.name}`, async () => {
      const picture = await decodePicture(bytesOf(example.file), "image/any");
      const raw = bytesOf(example.levels);
      const wanted = example.bits === 16 ? new Uint16Array(raw.buffer) : raw;
      expect([picture.width, picture.height, picture.bits]).toEqual([example.width, example.height, example.bits]);
      const worst = Math.max(...Array.from(picture.levels, (level, k) => Math.abs(level - (wanted[k] ?? NaN))));
      // A luma may be rounded to either side by different orders of addition.
      expect(worst).toBeLessThanOrEqual(1);
    });
  }

  it("that is cut off is an error that says what to do", async () => {
    for (const example of examples) {
      const whole = bytesOf(example.file);
      await expect(decodePicture(whole.slice(0, whole.length >> 1), "image/any")).rejects.toThrow(PictureError);
    }
  });
});

describe("compressed data", () => {
  it("of damaged codes are refused", () => {
    expect(() => unpackLzw(Uint8Array.of(0xff, 0xff, 0xff), 10)).toThrow(PictureError);
    expect(() => unpackBits(Uint8Array.of(5, 1), 10)).toThrow(PictureError);
  });
});
