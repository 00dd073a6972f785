import { describe, expect, it } from "vitest";

import { compared, differs } from "../../src/images/comparison";
import {
  appended,
  changesOf,
  current,
  edited,
  EMPTY,
  nextKey,
  redone,
  revisionOf,
  undone,
  wrongWith,
} from "../../src/images/draft";
import { rebased } from "../../src/images/rebase";
import { ballCentres, centreAt, centreName, partnerOf, placeInSpine, sceneOf } from "../../src/images/scene";
import { candidatesDocument, featuresDocument, triadsDocument } from "./documents";

const scene = sceneOf(triadsDocument(), featuresDocument(), candidatesDocument(), ["L1", "T11"]);

describe("a scene", () => {
  it("joins the balls of triads with their features", () => {
    expect(ballCentres(scene, "left").map((centre) => centre.key)).toEqual(["f0", "f1", "f2", "f3", "f4"]);
    expect(ballCentres(scene, "right").map((centre) => centre.key)).toEqual(["f0", "f1", "f2", "f3", "f4", "f5"]);
    const centre = centreAt(scene, "left", "f1");
    expect([centre?.triad, centre?.ball, centre?.covariance]).toEqual([0, "YY", [0.010000000000000002, 0.0050000000000000010, 0.010000000000000002]]);
    expect(centreName(scene, scene.left[1]!)).toBe("L1 YY");
    expect(partnerOf(scene, scene.left[1]!)?.key).toBe("f1");
  });

  it("has no centre where a ball is hidden", () => {
    expect(scene.triads[1]?.balls[2]?.left).toBeNull();
    expect(partnerOf(scene, centreAt(scene, "right", "f5")!)).toBeNull();
  });

  it("says why a feature is no ball", () => {
    expect(centreAt(scene, "left", "f5")?.reason).toBe("no-partner");
    expect(centreAt(scene, "left", "f0")?.reason).toBeNull();
  });

  it("keeps a ball that is no feature", () => {
    const triads = triadsDocument();
    triads.triads[0]!.balls["XX"]!.left = [400, 300];
    const other = sceneOf(triads, featuresDocument(), null, ["L1", "T11"]);
    const key = other.triads[0]?.balls[0]?.left ?? null;
    expect(key).toBe("b0XX");
    expect(centreAt(other, "left", key)?.feature).toBeNull();
  });

  it("takes the balls of a burst's pair from its candidates", () => {
    const burst = sceneOf(triadsDocument(), featuresDocument(), candidatesDocument(), ["L1", "T11"], true);
    expect(burst.triads[0]?.balls.map((ball) => [ball.left, ball.right])).toEqual([
      ["f2", "f0"],
      ["f1", "f1"],
      ["f0", "f2"],
    ]);
    expect(burst.triads[1]?.balls.map((ball) => ball.left)).toEqual([null, null, null]);
  });

  it("gives a triad the place of its vertebra", () => {
    expect(scene.triads.map((triad) => placeInSpine(scene, triad))).toEqual([0, 1]);
    expect(placeInSpine(scene, { ...scene.triads[1]!, label: null })).toBe(3);
  });
});

describe("a correction", () => {
  const moved = appended(EMPTY, { kind: "move", side: "left", key: "f1", to: [207.4, 189.9] });

  it("moves, adds and removes ball centres by the numbers of the features", () => {
    let draft = appended(moved, { kind: "add", side: "right", key: nextKey(moved), at: [300.25, 200] });
    draft = appended(draft, { kind: "remove-centre", side: "right", key: "f6" });
    draft = appended(draft, { kind: "label", triad: 1, label: "T11" });
    draft = appended(draft, { kind: "remove-triad", triad: 0 });
    expect(revisionOf(edited(scene, draft), 2)).toEqual({
      kind: "edit",
      take: 3,
      labels: [{ triad: 1, label: "T11" }],
      removed: [0],
      centres: [
        { action: "move", pair: 2, side: "left", feature: 1, x: 207.4, y: 189.9 },
        { action: "remove", pair: 2, side: "right", feature: 6 },
        { action: "add", pair: 2, side: "right", x: 300.25, y: 200 },
      ],
    });
  });

  it("is one step while the same centre moves on, and none after it is undone", () => {
    const on = appended(moved, { kind: "move", side: "left", key: "f1", to: [207.5, 189.9] });
    expect(current(on)).toHaveLength(1);
    expect(centreAt(edited(scene, on), "left", "f1")?.pixel).toEqual([207.5, 189.9]);
    const before = undone(on);
    expect(revisionOf(edited(scene, before), 1)).toBeNull();
    expect(edited(scene, redone(before)).editedCentres.size).toBe(1);
    expect(appended(before, { kind: "remove-triad", triad: 0 }).edits).toHaveLength(1);
  });

  it("places a new centre where it is moved to, and forgets it when it is removed", () => {
    const added = appended(EMPTY, { kind: "add", side: "left", key: "n1", at: [10, 10] });
    const on = appended(added, { kind: "move", side: "left", key: "n1", to: [11, 10] });
    expect(current(on)).toEqual([{ kind: "add", side: "left", key: "n1", at: [11, 10] }]);
    const gone = appended(on, { kind: "remove-centre", side: "left", key: "n1" });
    expect(revisionOf(edited(scene, gone), 1)).toBeNull();
    expect(nextKey(gone)).toBe("n2");
  });

  it("is described in sentences", () => {
    let draft = appended(moved, { kind: "label", triad: 0, label: "L1" });
    draft = appended(draft, { kind: "label", triad: 1, label: null });
    draft = appended(draft, { kind: "add", side: "right", key: "n1", at: [300, 200] });
    const texts = changesOf(scene, edited(scene, draft)).map((change) => change.text);
    expect(texts).toEqual([
      "Confirm label L1",
      "Take away label T11",
      "Move ball centre L1 YY, left image, by 0.4 px",
      "Add a ball centre, right image",
    ]);
  });

  it("cannot give two triads the same label", () => {
    const twice = edited(scene, appended(EMPTY, { kind: "label", triad: 0, label: "T11" }));
    expect(wrongWith(twice)).toContain("Two triads are labelled T11");
    const other = edited(scene, appended(appended(EMPTY, { kind: "label", triad: 0, label: "T11" }), { kind: "remove-triad", triad: 1 }));
    expect(wrongWith(other)).toBeNull();
    expect(wrongWith(edited(scene, EMPTY))).toBeNull();
  });

  it("is carried over to a newer take of the same images", () => {
    const newer = triadsDocument();
    newer.take = 4;
    newer.triads.reverse();
    const features = featuresDocument();
    features.features.left.unshift(features.features.left.splice(1, 1)[0]!);
    const next = sceneOf(newer, features, null, ["L1", "T11"]);
    const draft = appended(moved, { kind: "label", triad: 1, label: "L1" });
    const result = rebased(draft, scene, next);
    expect(result.lost).toEqual([]);
    expect(revisionOf(edited(next, result.draft), 1)).toMatchObject({
      take: 4,
      labels: [{ triad: 0, label: "L1" }],
      centres: [{ action: "move", feature: 0, x: 207.4 }],
    });
  });

  it("says what cannot be carried over", () => {
    const newer = triadsDocument();
    newer.triads.pop();
    const features = featuresDocument();
    features.features.left.splice(1, 1);
    const next = sceneOf(newer, features, null, ["L1", "T11"]);
    const result = rebased(appended(moved, { kind: "remove-triad", triad: 1 }), scene, next);
    expect(result.draft).toEqual(EMPTY);
    expect(result.lost).toEqual([
      "Ball centre L1 YY of the left image is not in the newer take.",
      "T11 is not in the newer take.",
    ]);
  });
});

describe("two takes", () => {
  it("do not differ when nothing was changed", () => {
    expect(differs(compared(scene, scene))).toBe(false);
  });

  it("differ in labels, positions and ball centres", () => {
    const triads = triadsDocument();
    triads.triads[0]!.label = "T12";
    triads.triads[0]!.position_mm = [100.3, 200.4, 50];
    triads.triads[0]!.balls["YY"]!.left = [207.3, 190.4];
    triads.triads.pop();
    const features = featuresDocument();
    [features.features.left[1]!.x, features.features.left[1]!.y] = [207.3, 190.4];
    const result = compared(scene, sceneOf(triads, features, null, ["L1", "T11"]));
    expect(result.triads[0]).toMatchObject({ name: "T12", labelThen: "L1", labelNow: "T12", in: "both" });
    expect(result.triads[0]?.movedMm).toBeCloseTo(0.5, 10);
    expect(result.triads[0]?.movedPx.left).toBeCloseTo(0.5, 10);
    expect(result.triads[0]?.movedPx.right).toBe(0);
    expect(result.triads[1]).toMatchObject({ name: "T11", in: "then", movedMm: null });
    expect(result.shifts.filter((shift) => shift.now === null)).toHaveLength(5);
  });
});
