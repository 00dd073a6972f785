import { describe, expect, it } from "vitest";

import { STATUS } from "../../src/format/status";
import { blend, lookOf, type Palette, stageColour } from "../../src/spine3d/appearance";
import { contentOf, type Picture, vectorLengths } from "../../src/spine3d/content";
import { legendOf, type Shown } from "../../src/spine3d/legend";
import { parseRgb } from "../../src/spine3d/palette";
import { describe as inWords } from "../../src/spine3d/words";
import { body, PALETTE, spine, vertebra } from "./builders";

const PICTURE: Picture = {
  now: [
    body("T11", 0, [0, 0, 60]),
    body("T12", 1, [0, 5, 30], { status: "interpolated" }),
    body("L1", 2, [0, 0, 0], { status: "assumed" }),
  ],
  before: [body("T11", 0, [0, 9, 60])],
  plan: [body("T11", 0, [0, 1, 61])],
  stages: [],
  triads: [],
  selected: null,
  switches: { shapes: true, vectors: false, triads: false, line: true, regions: 0 },
  palette: PALETTE,
};

describe("lookOf", () => {
  it("tells statuses apart by fill and dash, not by colour alone", () => {
    const looks = (["measured", "interpolated", "assumed"] as const).map((status) => lookOf(status, "now", PALETTE));
    expect(looks.map(({ outline, dash }) => [outline, dash])).toEqual([
      ["none", [1, 0]],
      ["body", [...STATUS.interpolated.dash]],
      ["body", [...STATUS.assumed.dash]],
    ]);
  });

  it("draws the plan as an outline without gaps, and the earlier stage see-through", () => {
    expect(lookOf("measured", "plan", PALETTE)).toMatchObject({ opacity: 0, outline: "body", dash: [1, 0] });
    const before = lookOf("measured", "before", PALETTE);
    expect(before.opacity).toBeGreaterThan(0);
    expect(before.opacity).toBeLessThan(0.5);
  });

  it("marks the selected one by its outline and the colour of the focus", () => {
    expect(lookOf("measured", "now", PALETTE, true)).toMatchObject({ outline: "whole", edge: PALETTE["--focus"] });
  });

  it("has a colour even for an unknown name", () => {
    expect(lookOf("measured", "now", {} as Palette).fill).toEqual([0.5, 0.5, 0.5]);
  });
});

describe("colours", () => {
  it("go from pale to the accent over the stages", () => {
    expect(stageColour(2, 3, PALETTE)).toEqual(PALETTE["--accent"]);
    expect(stageColour(0, 1, PALETTE)).toEqual(PALETTE["--accent"]);
    expect(stageColour(0, 3, PALETTE)).not.toEqual(PALETTE["--accent"]);
    expect(blend([0, 0, 0], [1, 0.5, 0], 0.5)).toEqual([0.5, 0.25, 0]);
  });

  it("are read from what the browser computes", () => {
    expect(parseRgb("rgb(255, 0, 51)")).toEqual([1, 0, 0.2]);
    expect(parseRgb("rgba(0 0 0 / 0.5)")).toEqual([0, 0, 0]);
    expect(parseRgb("oklch(0.5 0 0)")).toEqual([0.5, 0.5, 0.5]);
  });
});

describe("contentOf", () => {
  it("draws fills of what has one, and outlines of what is not measured", () => {
    const content = contentOf(PICTURE);
    expect(content.vertebrae).toHaveLength(4);
    expect(content.bodyOutlines).toHaveLength(3);
    expect(content.outlines).toEqual([]);
    expect(content.planOutlines).toHaveLength(1);
    expect(content.cones).toEqual([]);
    expect(content.ellipsoids).toEqual([]);
  });

  it("draws the line with the weaker status of its ends, and dashes that go on", () => {
    const { curves } = contentOf({ ...PICTURE, before: [], plan: [] });
    expect(curves).toHaveLength(12);
    expect(curves[0]?.dash).toEqual([...STATUS.interpolated.dash]);
    expect(curves[11]?.dash).toEqual([...STATUS.assumed.dash]);
    curves.slice(1).forEach((segment, k) => expect(segment.start).toBeGreaterThan(curves[k]?.start ?? Infinity));
  });

  it("draws three vectors a vertebra, which end outside its body", () => {
    const content = contentOf({ ...PICTURE, switches: { ...PICTURE.switches, vectors: true } });
    expect(content.cones).toHaveLength(3 * 4);
    vectorLengths([30, 40, 24]).forEach((length, k) => expect(length).toBeGreaterThan([15, 20, 12][k] ?? 0));
  });

  it("draws vectors and the line of what is shown without shapes", () => {
    const content = contentOf({ ...PICTURE, switches: { ...PICTURE.switches, shapes: false, line: false } });
    expect(content.vertebrae).toEqual([]);
    expect(content.curves.length).toBeGreaterThan(0);
  });

  it("draws an ellipsoid with three rings, and two rings of directions, at a scale", () => {
    const at = (regions: number): ReturnType<typeof contentOf> =>
      contentOf({ ...PICTURE, now: PICTURE.now.slice(0, 1), switches: { ...PICTURE.switches, regions } });
    expect(at(1).ellipsoids).toHaveLength(1);
    expect(at(1).circles).toHaveLength(5);
    const size = ({ ellipsoids: [first] }: ReturnType<typeof contentOf>): number =>
      Math.hypot(...(first?.matrix.slice(0, 3) ?? []));
    expect(size(at(1))).toBeCloseTo(3 * Math.sqrt(7.8147), 3);
    expect(size(at(5)) / size(at(1))).toBeCloseTo(5);
  });

  it("draws no region without a covariance: between two stages", () => {
    const now = PICTURE.now.map((item) => ({ ...item, covariance: null }));
    expect(contentOf({ ...PICTURE, now, switches: { ...PICTURE.switches, regions: 1 } }).ellipsoids).toEqual([]);
  });

  it("draws all stages as simple bodies, or as lines", () => {
    const stages = [PICTURE.now, PICTURE.now];
    const { simpleBodies, curves } = contentOf({ ...PICTURE, now: [], before: [], plan: [], stages });
    expect(simpleBodies).toHaveLength(6);
    expect(curves).toEqual([]);
    const lines = contentOf({ ...PICTURE, now: [], before: [], stages, switches: { ...PICTURE.switches, shapes: false } });
    expect(lines.simpleBodies).toEqual([]);
    expect(lines.curves).toHaveLength(4);
  });

  it("draws balls that one camera saw in another colour, with a dashed leg", () => {
    const balls = [
      { name: "XX", position: [1, 0, 0] as const, inBoth: true },
      { name: "YY", position: [0, 1, 0] as const, inBoth: false },
    ];
    const triads = [{ label: "T9", place: { position: [0, 0, 0] as const, rotation: [0, 0, 0, 1] as const }, balls }];
    const content = contentOf({ ...PICTURE, triads, switches: { ...PICTURE.switches, triads: true } });
    expect(content.balls).toHaveLength(2);
    expect(content.balls[0]?.colour).not.toEqual(content.balls[1]?.colour);
    expect(content.segments.slice(0, 2).map(({ dash }) => dash[1] > 0)).toEqual([false, true]);
    expect(content.segments).toHaveLength(5);
  });
});

describe("legendOf", () => {
  const nothing: Shown = {
    statuses: new Set(),
    hasGaps: false,
    before: null,
    plan: false,
    all: [],
    vectors: false,
    triads: false,
    regions: 0,
  };

  it("explains what is shown, and nothing else", () => {
    expect(legendOf(nothing)).toEqual([]);
    const keys = legendOf({ ...nothing, statuses: new Set(["assumed", "measured"]), hasGaps: true, before: "PRE", plan: true });
    expect(keys.map(({ key }) => key)).toEqual(["measured", "assumed", "not_measured", "before", "plan"]);
  });

  it("says when regions are enlarged", () => {
    expect(legendOf({ ...nothing, regions: 5 })[0]?.note).toContain("5 times larger");
    expect(legendOf({ ...nothing, regions: 1 })[0]?.note).not.toContain("larger");
  });
});

describe("describe", () => {
  it("says in words what the picture shows", () => {
    const shown = spine([vertebra("T12", null), vertebra("L1", [0, 0, 0]), vertebra("L2", [0, 0, -30], "interpolated")], {
      curves: [{ name: "curve 1", upper: "T12", apex: "L1", lower: "L2", side: "left", open_ends: [] }],
    });
    expect(inWords({ spine: shown, before: "PRE", hasPlan: true, stages: 0, selected: "L1" })).toBe(
      "3D view of the spine at stage POST: 1 measured, 1 interpolated. Not measured: T12. Curve 1 from T12 to L2, apex L1," +
        " convex to the left. Laid over stage PRE. The plan is drawn too. L1 is selected. The numbers are in the table of the" +
        " vertebrae.",
    );
  });
});
