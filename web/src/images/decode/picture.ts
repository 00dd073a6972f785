/** From the bytes of an image file to gray levels, for every format that the service accepts. */
import type { Picture } from "../levels";
import { luma, PictureError } from "./parts";
import { decodePng16, isPng16 } from "./png";
import { decodeSunRaster, isSunRaster } from "./sun-raster";
import { decodeTiff, isTiff } from "./tiff";

/**
 * Return the gray levels of an image file as the sensor wrote them.
 *
 * Browsers show PNG and JPEG, but reduce 16 bits to 8, and show neither TIFF nor Sun raster: these are decoded here.
 */
export async function decodePicture(bytes: Uint8Array<ArrayBuffer>, mediaType: string): Promise<Picture> {
  if (isPng16(bytes)) return decodePng16(bytes);
  if (isTiff(bytes)) return decodeTiff(bytes);
  if (isSunRaster(bytes)) return decodeSunRaster(bytes);
  return decodeByBrowser(bytes, mediaType);
}

async function decodeByBrowser(bytes: Uint8Array<ArrayBuffer>, mediaType: string): Promise<Picture> {
  // As stored: a rotation tag and a colour profile say nothing about the sensor.
  const options: ImageBitmapOptions = {
    imageOrientation: "none",
    colorSpaceConversion: "none",
    premultiplyAlpha: "none",
  };
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(new Blob([bytes], { type: mediaType }), options);
  } catch {
    throw new PictureError("This browser cannot show the image file. Download it to look at it.");
  }
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (context === null) throw new PictureError("This browser cannot draw images. Use another one.");
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const { data, width, height } = context.getImageData(0, 0, canvas.width, canvas.height);
  const levels = new Uint8Array(width * height);
  for (let k = 0; k < levels.length; k++) {
    levels[k] = luma(data[4 * k] ?? 0, data[4 * k + 1] ?? 0, data[4 * k + 2] ?? 0);
  }
  return { width, height, levels, bits: 8 };
}
