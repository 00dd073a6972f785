import { describe, expect, it } from "vitest";

import { dragged, keyed, pinched, wheeled } from "../../src/spine3d/gestures";
import { neighbour, pick } from "../../src/spine3d/picking";
import { cross, dot, type Vec3 } from "../../src/spine3d/vectors";
import {
  basisOf,
  edgeNames,
  fit,
  namedView,
  orbit,
  pan,
  project,
  ROOM,
  scaleBar,
  unproject,
  type View,
  VIEWS,
  viewInWords,
  zoom,
} from "../../src/spine3d/views";
import { body } from "./builders";

const SCREEN = { width: 800, height: 400 };
const CORONAL: View = { ...VIEWS.coronal, centre: [0, 0, 0], height: 200 };

function near(found: readonly number[], expected: readonly number[]): void {
  found.forEach((value, k) => expect(value).toBeCloseTo(expected[k] ?? NaN, 9));
}

describe("fixed views", () => {
  it("are those of the report: from behind, from the right, from the head", () => {
    const expected: Record<string, Vec3[]> = {
      coronal: [[0, -1, 0], [0, 0, 1], [-1, 0, 0]],
      sagittal: [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
      top: [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    };
    for (const [name, [right = [], up = [], toward = []]] of Object.entries(expected)) {
      const basis = basisOf(VIEWS[name as "top"]);
      near(basis.right, right);
      near(basis.up, up);
      near(basis.toward, toward);
    }
  });

  it("name the edges by the patient's directions", () => {
    expect(edgeNames(CORONAL)).toEqual({ left: "L", right: "R", top: "head", bottom: "feet" });
    expect(edgeNames({ ...CORONAL, ...VIEWS.sagittal })).toEqual({ left: "P", right: "A", top: "head", bottom: "feet" });
    expect(edgeNames({ ...CORONAL, ...VIEWS.top })).toEqual({ left: "L", right: "R", top: "A", bottom: "P" });
    expect(edgeNames({ ...CORONAL, azimuth: 225 })).toEqual({ left: "", right: "", top: "head", bottom: "feet" });
  });

  it("are recognised, and told in words", () => {
    expect(namedView(CORONAL)).toBe("coronal");
    expect(namedView(orbit(CORONAL, 5, 0))).toBeNull();
    expect(viewInWords(CORONAL)).toBe("Coronal, from behind");
    expect(viewInWords({ ...CORONAL, ...VIEWS.free })).toBe("From posterior and right and cephalad");
  });
});

describe("orbit, zoom and pan", () => {
  it("keeps a right-handed basis wherever it turns, and stops over the head", () => {
    let view = CORONAL;
    for (const [turn, tilt] of [[20, 30], [-100, 80], [400, -250]] as const) {
      view = orbit(view, turn, tilt);
      const { right, up, toward } = basisOf(view);
      near(cross(right, up), toward);
      expect(dot(right, right)).toBeCloseTo(1);
    }
    expect(orbit(CORONAL, 0, 500).elevation).toBe(90);
    expect(orbit(CORONAL, -190, 0).azimuth).toBe(350);
  });

  it("zooms about a place, which stays where it is", () => {
    const point: Vec3 = [3, 40, -25];
    const before = project(CORONAL, SCREEN, point);
    const zoomed = zoom(CORONAL, 1.7, SCREEN, [before.x - 400, 200 - before.y]);
    const after = project(zoomed, SCREEN, point);
    expect(after.x).toBeCloseTo(before.x);
    expect(after.y).toBeCloseTo(before.y);
    expect(zoomed.height).toBeCloseTo(200 / 1.7);
    expect(zoom(CORONAL, 1e9, SCREEN).height).toBe(20);
  });

  it("projects and finds the place again", () => {
    const view = pan(orbit(CORONAL, 33, 12), 5, -8);
    const { x, y, depth } = project(view, SCREEN, [10, 20, 30]);
    const { toward } = basisOf(view);
    const found = unproject(view, SCREEN, x, y).map((value, k) => value + depth * (toward[k] ?? 0));
    near(found, [10, 20, 30]);
  });
});

describe("fit", () => {
  it("shows everything inside the room for it, and the height or the width of it to the full", () => {
    const shown = [
      { at: [0, 0, 400] as Vec3, mm: 20 },
      { at: [30, -40, 100] as Vec3, mm: 25 },
      { at: [0, 0, 0] as Vec3, mm: 20 },
    ];
    for (const direction of Object.values(VIEWS)) {
      const view = fit(direction, shown, SCREEN) ?? CORONAL;
      const pxPerMm = SCREEN.height / view.height;
      const ends = shown.map(({ at, mm }) => ({ ...project(view, SCREEN, at), r: mm * pxPerMm }));
      const margins = [
        Math.min(...ends.map(({ x, r }) => x - r)) - ROOM.left,
        SCREEN.width - ROOM.right - Math.max(...ends.map(({ x, r }) => x + r)),
        Math.min(...ends.map(({ y, r }) => y - r)) - ROOM.top,
        SCREEN.height - ROOM.bottom - Math.max(...ends.map(({ y, r }) => y + r)),
      ];
      expect(Math.min(...margins)).toBeCloseTo(0, 6);
    }
  });

  it("leaves room for what is drawn beside", () => {
    const shown = [{ at: [0, 0, 0] as Vec3, mm: 30 }];
    const view = fit(VIEWS.coronal, shown, SCREEN, 1000) ?? CORONAL;
    const beside = pan({ ...view, centre: [0, 0, 0] }, 1000, 0).centre;
    expect(project(view, SCREEN, beside).x).toBeLessThan(SCREEN.width - ROOM.right);
  });

  it("has no view of nothing", () => {
    expect(fit(VIEWS.coronal, [], SCREEN)).toBeNull();
    expect(fit(VIEWS.coronal, [{ at: [0, 0, 0], mm: 1 }], { width: 0, height: 0 })).toBeNull();
  });
});

describe("scaleBar", () => {
  it("is a round length of at most a seventh of the width", () => {
    for (const height of [33, 70, 200, 410, 999]) {
      const { mm, px } = scaleBar({ ...CORONAL, height }, SCREEN);
      expect([1, 2, 5]).toContain(Number(mm.toPrecision(1)) / 10 ** Math.floor(Math.log10(mm)));
      expect(px).toBeLessThanOrEqual(SCREEN.width / 7);
      expect(px).toBeGreaterThan(SCREEN.width / 7 / 2.51);
      expect(px / mm).toBeCloseTo(SCREEN.height / height);
    }
  });
});

describe("gestures", () => {
  it("turn the spine with the pointer: its front follows", () => {
    const before = project(CORONAL, SCREEN, [-20, 0, 0]).x;
    expect(project(dragged(CORONAL, SCREEN, 30, 0, false), SCREEN, [-20, 0, 0]).x).toBeGreaterThan(before);
    const up = dragged(CORONAL, SCREEN, 0, -30, false);
    expect(project(up, SCREEN, [-20, 0, 0]).y).toBeLessThan(200);
  });

  it("move it with the pointer", () => {
    const { x, y } = project(dragged(CORONAL, SCREEN, 17, -9, true), SCREEN, [0, 0, 0]);
    near([x, y], [417, 191]);
  });

  it("keep the points under two fingers where they are", () => {
    const before = [[300, 150], [500, 150]] as const;
    const after = [[250, 170], [650, 170]] as const;
    const point = unproject(CORONAL, SCREEN, 400, 150);
    const view = pinched(CORONAL, SCREEN, before, after);
    expect(view.height).toBeCloseTo(100);
    const { x, y } = project(view, SCREEN, point);
    near([x, y], [450, 170]);
    expect(pinched(CORONAL, SCREEN, [[1, 1], [1, 1]], [[1, 1], [5, 1]]).height).toBe(200);
  });

  it("zoom with the wheel about the pointer", () => {
    const point = unproject(CORONAL, SCREEN, 100, 300);
    const view = wheeled(CORONAL, SCREEN, -120, [100, 300]);
    expect(view.height).toBeLessThan(200);
    const { x, y } = project(view, SCREEN, point);
    near([x, y], [100, 300]);
  });

  it("turn, move, zoom and command by keys", () => {
    expect(keyed(CORONAL, "ArrowLeft", false)).toMatchObject({ azimuth: 187.5 });
    expect(keyed(CORONAL, "ArrowDown", false)).toMatchObject({ elevation: 7.5 });
    const moved = keyed(CORONAL, "ArrowRight", true);
    expect(project(moved as View, SCREEN, [0, 0, 0]).x).toBeGreaterThan(400);
    expect((keyed(CORONAL, "+", false) as View).height).toBeLessThan(200);
    expect((keyed(CORONAL, "-", false) as View).height).toBeGreaterThan(200);
    expect(["0", "2", "PageUp", "]", "Escape"].map((key) => keyed(CORONAL, key, false))).toEqual([
      "fit",
      "coronal",
      "above",
      "below",
      "clear",
    ]);
    expect(keyed(CORONAL, "a", false)).toBeNull();
  });
});

describe("picking", () => {
  const bodies = [body("T12", 0, [0, 0, 30]), body("L1", 1, [0, 0, 0]), body("L2", 2, [80, 0, 0])];

  it("finds the body at the place, the nearest first", () => {
    const at = (point: Vec3): [number, number] => {
      const { x, y } = project(CORONAL, SCREEN, point);
      return [x, y];
    };
    expect(pick(bodies, CORONAL, SCREEN, ...at([0, 5, 32]))?.level).toBe("T12");
    expect(pick(bodies, CORONAL, SCREEN, ...at([0, 0, 0]))?.level).toBe("L1");
    expect(pick(bodies, { ...CORONAL, azimuth: 0 }, SCREEN, ...at([0, 0, 0]))?.level).toBe("L2");
    expect(pick(bodies, CORONAL, SCREEN, ...at([0, 60, 0]))).toBeNull();
  });

  it("finds a turned body by its processes too", () => {
    const quarter = body("T9", 0, [0, 0, 0], { rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2] });
    const { x, y } = project(CORONAL, SCREEN, [0, -38, 0]);
    expect(pick([quarter], CORONAL, SCREEN, x, y)?.level).toBe("T9");
    expect(pick([body("T9", 0, [0, 0, 0])], CORONAL, SCREEN, x, y)).toBeNull();
  });

  it("steps from one vertebra to the next, and stays at the ends", () => {
    const levels = ["T12", "L1", "L2"];
    expect(neighbour(levels, "T12", 1)).toBe("L1");
    expect(neighbour(levels, "T12", -1)).toBe("T12");
    expect(neighbour(levels, null, 1)).toBe("T12");
    expect(neighbour(levels, "T3", -1)).toBe("L2");
    expect(neighbour([], null, 1)).toBeNull();
  });
});
