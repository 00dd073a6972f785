/** Brightness and contrast of both images. */
import { useMemo, useState } from "preact/hooks";

import type { Side } from "./camera";
import { adjusted, type Contrast, fullWindow, type Picture, PLAIN, stretchedWindow, type Window } from "./levels";
import { usePictureCanvas } from "./picture-canvas";
import type { PictureState } from "./use-picture";

interface ContrastState {
  contrast: Contrast;
  /** Contrast as it is at first: images of 16 bits rarely use all levels, and are stretched. */
  plain: Contrast;
  change: (contrast: Contrast) => void;
  /** Both pictures as they are shown. */
  sources: Readonly<Record<Side, HTMLCanvasElement | null>>;
}

/** The same contrast for both images, each from its own levels. */
export function useContrast(left: PictureState, right: PictureState): ContrastState {
  const [changed, setChanged] = useState<Contrast | null>(null);
  const pictures = [left, right].map((state) => (state.state === "ready" ? state.picture : null)) as [Picture | null, Picture | null];
  const plain: Contrast = { ...PLAIN, stretched: pictures.some((picture) => picture?.bits === 16) };
  const contrast = changed ?? plain;
  const sources = {
    left: usePictureCanvas(pictures[0], useWindow(pictures[0], contrast)),
    right: usePictureCanvas(pictures[1], useWindow(pictures[1], contrast)),
  };
  return { contrast, plain, change: setChanged, sources };
}

function useWindow(picture: Picture | null, contrast: Contrast): Window | null {
  const whole = useMemo(
    () => (picture === null ? null : contrast.stretched ? stretchedWindow(picture) : fullWindow(picture)),
    [picture, contrast.stretched],
  );
  return whole === null ? null : adjusted(whole, contrast);
}
