import { describe, expect, it } from "vitest";

import { adjusted, fullWindow, lookup, type Picture, PLAIN, shown, stretchedWindow } from "../../src/images/levels";
import { triadLook } from "../../src/images/looks";
import { centred, fitted, framed, kept, MAX_ZOOM, panned, toPixel, toScreen, type View, zoomed } from "../../src/images/view";
import { keyAction } from "../../src/images/viewer-keys";
import type { Vec2 } from "../../src/images/vectors";

const size: Vec2 = [800, 600];
const image: Vec2 = [568, 416];

describe("the view of both images", () => {
  const whole = fitted(size, image, image);

  it("shows both images whole at first", () => {
    expect(toScreen(whole, size, "left", [(image[0] - 1) / 2, (image[1] - 1) / 2])).toEqual([400, 300]);
    const [x0] = toScreen(whole, size, "left", [-0.5, -0.5]);
    const [x1] = toScreen(whole, size, "left", [image[0] - 0.5, image[1] - 0.5]);
    expect(x0).toBeCloseTo(0, 9);
    expect(x1).toBeCloseTo(800, 9);
  });

  it("keeps the pixel under the pointer when it zooms, and both zoom alike", () => {
    const at: Vec2 = [123, 456];
    const before = toPixel(whole, size, "left", at);
    const closer = zoomed(whole, size, 3, at, whole.zoom);
    const after = toPixel(closer, size, "left", at);
    expect(after[0]).toBeCloseTo(before[0], 9);
    expect(after[1]).toBeCloseTo(before[1], 9);
    expect(closer.right[0] - whole.right[0]).toBeCloseTo(closer.left[0] - whole.left[0], 9);
  });

  it("zooms neither farther than the whole image nor closer than pixels can be told", () => {
    expect(zoomed(whole, size, 0.01, [0, 0], whole.zoom).zoom).toBe(whole.zoom);
    expect(zoomed(whole, size, 1e6, [0, 0], whole.zoom).zoom).toBe(MAX_ZOOM);
  });

  it("moves by screen pixels and stays on the images", () => {
    const view: View = { zoom: 4, left: [100, 100], right: [50, 60] };
    expect(panned(view, [40, -20])).toEqual({ zoom: 4, left: [90, 105], right: [40, 65] });
    expect(kept({ zoom: 4, left: [-10, 9999], right: [50, 60] }, image, image).left).toEqual([0, 415]);
  });

  it("looks at a ball in both images, and leaves an image where it is hidden", () => {
    expect(centred(whole, [200, 100], null, 6)).toEqual({ zoom: 6, left: [200, 100], right: whole.right });
  });

  it("frames all balls of both images", () => {
    const view = framed(size, [[100, 100], [300, 150]], [[50, 120], [200, 160]], whole.zoom);
    expect(view?.left).toEqual([200, 125]);
    for (const place of [[100, 100], [300, 150]] as Vec2[]) {
      const [x, y] = toScreen(view!, size, "left", place);
      expect(x > 0 && x < 800 && y > 0 && y < 600).toBe(true);
    }
    expect(framed(size, [], [[1, 1]], whole.zoom)).toBeNull();
  });
});

describe("the gray levels", () => {
  const picture: Picture = { width: 4, height: 1, levels: Uint16Array.of(100, 200, 300, 400), bits: 16 };

  it("are all of those that are possible, or those that occur", () => {
    expect(fullWindow(picture)).toEqual({ black: 0, white: 65535 });
    expect(stretchedWindow(picture)).toEqual({ black: 100, white: 400 });
    expect(stretchedWindow({ ...picture, levels: Uint16Array.of(7, 7, 7, 7) })).toEqual(fullWindow(picture));
  });

  it("become brighter and of more contrast about the middle", () => {
    expect(adjusted({ black: 0, white: 100 }, PLAIN)).toEqual({ black: 0, white: 100 });
    expect(adjusted({ black: 0, white: 100 }, { ...PLAIN, contrast: 2 })).toEqual({ black: 25, white: 75 });
    expect(adjusted({ black: 0, white: 100 }, { ...PLAIN, brightness: 0.25 })).toEqual({ black: -25, white: 75 });
  });

  it("are black below and white above the window", () => {
    const table = lookup({ black: 50, white: 150 }, 8);
    expect([table[0], table[50], table[100], table[150], table[255]]).toEqual([0, 0, 128, 255, 255]);
    const pixels = [...shown(picture, { black: 100, white: 400 })];
    expect(pixels).toEqual([0, 0, 0, 255, 85, 85, 85, 255, 170, 170, 170, 255, 255, 255, 255, 255]);
  });
});

describe("the keys of a view", () => {
  const key = (name: string, held: Partial<Record<"shiftKey" | "ctrlKey", boolean>> = {}, moves = false) =>
    keyAction({ key: name, shiftKey: false, ctrlKey: false, metaKey: false, altKey: false, ...held }, moves);

  it("move a chosen ball centre in a correction, and the image otherwise", () => {
    expect(key("ArrowRight")).toEqual({ kind: "pan", by: [-48, -0] });
    expect(key("ArrowRight", {}, true)).toEqual({ kind: "nudge", by: [0.1, 0] });
    expect(key("ArrowUp", { shiftKey: true }, true)).toEqual({ kind: "nudge", by: [0, -1] });
  });

  it("leave the browser's own keys alone", () => {
    expect(key("+", { ctrlKey: true })).toBeNull();
    expect(key("Tab")).toBeNull();
    expect(key("n")).toEqual({ kind: "step", by: 1 });
  });
});

describe("the looks of triads", () => {
  it("differ in colour and line between neighbours, and are all different in a long spine", () => {
    const looks = Array.from({ length: 18 }, (_, k) => triadLook(k));
    for (let k = 1; k < looks.length; k++) {
      expect(looks[k]?.colour).not.toBe(looks[k - 1]?.colour);
      expect(looks[k]?.dash).not.toBe(looks[k - 1]?.dash);
    }
    expect(new Set(looks.map((look) => `${look.colour}/${look.dash}`)).size).toBe(looks.length);
  });
});
