/** What a take shows in its two images: ball centres and triads, joined from the documents of the API. */
import type { Feature, StageCandidates, StageFeatures, StageTriads } from "../api/types";
import { type Side, SIDES } from "./camera";
import { distance2, type Symmetric2, type Vec2, type Vec3, vec2, vec3 } from "./vectors";

/** A ball centre in one image. */
export interface Centre {
  /** `f12` feature 12, `n1` placed in this correction, `b0XX` ball of a triad that is no feature of this pair. */
  key: string;
  side: Side;
  pixel: Vec2;
  /** px²; null when it is not known. */
  covariance: Symmetric2 | null;
  /** Place in `features`; null for a centre that is none. */
  feature: number | null;
  /** Similarity to a ball, 0 to 1; null when it was not searched for. */
  score: number | null;
  /** Whether a person placed it. */
  manual: boolean;
  /** Place of its triad and the name of its ball there. */
  triad: number | null;
  ball: string | null;
  /** Why it belongs to no triad. */
  reason: FeatureReason | null;
}

export type FeatureReason = "no-partner" | "no-triad" | "rejected";

export interface TriadBall {
  name: string;
  /** Object space, mm. */
  position: Vec3;
  sd: Vec3;
  /** Keys of its centres; null where it is hidden. */
  left: string | null;
  right: string | null;
  parallaxMm: number | null;
}

export interface SceneTriad {
  index: number;
  label: string | null;
  labelReason: string | null;
  /** Whether a person decided on the label. */
  labelManual: boolean;
  model: string;
  /** Object space, mm; null without a pose. */
  position: Vec3 | null;
  positionSd: Vec3 | null;
  reason: string | null;
  balls: TriadBall[];
}

export interface Scene {
  take: number;
  /** The vertebrae with a marker, in their order along the spine. */
  vertebrae: readonly string[];
  triads: SceneTriad[];
  left: Centre[];
  right: Centre[];
}

/** Distance within which the ball of a triad is a feature, px. */
const SAME_PX = 0.01;

/**
 * Join the documents of a take.
 *
 * The triads of a burst are means over its pairs; their balls in one pair are those of the candidates that were chosen.
 */
export function sceneOf(
  triads: StageTriads,
  features: StageFeatures,
  candidates: StageCandidates | null,
  vertebrae: readonly string[],
  isBurst = false,
): Scene {
  const scene: Scene = { take: triads.take, vertebrae, triads: [], left: [], right: [] };
  for (const side of SIDES) {
    const uses = candidates?.explanation?.[side].features;
    scene[side] = features.features[side].map((feature, index) => ({
      ...centreOf(side, feature, index),
      reason: uses?.[index]?.reason ?? null,
    }));
  }
  scene.triads = triads.triads.map((triad, index) => ({
    index,
    label: triad.label,
    labelReason: triad.label_reason,
    labelManual: triad.label_manual ?? false,
    model: triad.model,
    position: triad.position_mm === null ? null : vec3(triad.position_mm),
    positionSd: triad.position_sd_mm === null ? null : vec3(triad.position_sd_mm),
    reason: triad.reason,
    balls: Object.entries(triad.balls).map(([name, ball]) => ({
      name,
      position: vec3(ball.position_mm),
      sd: vec3(ball.sd_mm),
      left: isBurst ? null : claimed(scene, "left", ball.left, index, name, ball.manual ?? []),
      right: isBurst ? null : claimed(scene, "right", ball.right, index, name, ball.manual ?? []),
      parallaxMm: ball.parallax_mm,
    })),
  }));
  if (isBurst) claimChosen(scene, candidates);
  return scene;
}

/** The centre with a key. */
export function centreAt(scene: Scene, side: Side, key: string | null): Centre | null {
  return key === null ? null : (scene[side].find((centre) => centre.key === key) ?? null);
}

/** The ball of a triad that a centre is; null for a centre without a triad. */
export function ballOf(scene: Scene, centre: Centre): TriadBall | null {
  const triad = centre.triad === null ? undefined : scene.triads[centre.triad];
  return triad?.balls.find((ball) => ball.name === centre.ball) ?? null;
}

/** The centre of the same ball in the other image; null where it is hidden, or for a centre without a triad. */
export function partnerOf(scene: Scene, centre: Centre): Centre | null {
  const ball = ballOf(scene, centre);
  if (ball === null) return null;
  return centre.side === "left" ? centreAt(scene, "right", ball.right) : centreAt(scene, "left", ball.left);
}

/** The centres of balls of triads in an image, in the order of the triads and their balls. */
export function ballCentres(scene: Scene, side: Side): Centre[] {
  return scene.triads.flatMap((triad) =>
    triad.balls.flatMap((ball) => {
      const centre = centreAt(scene, side, ball[side]);
      return centre === null ? [] : [centre];
    }),
  );
}

/** The place that decides on the look of a triad: that of its vertebra, so that it is the same in every take. */
export function placeInSpine(scene: Scene, triad: SceneTriad): number {
  const place = triad.label === null ? -1 : scene.vertebrae.indexOf(triad.label);
  return place < 0 ? scene.vertebrae.length + triad.index : place;
}

/** The name of a triad: its vertebra, or its number. */
export function triadName(triad: SceneTriad): string {
  return triad.label ?? `Triad ${triad.index + 1}`;
}

/** The name of a centre for people. */
export function centreName(scene: Scene, centre: Centre): string {
  const triad = centre.triad === null ? undefined : scene.triads[centre.triad];
  if (triad !== undefined && centre.ball !== null) return `${triadName(triad)} ${centre.ball}`;
  return centre.feature === null ? "New centre" : `Feature ${centre.feature + 1}`;
}

/** Standard deviations along u and v, px. */
export function deviations(centre: Centre): Vec2 | null {
  return centre.covariance === null ? null : [Math.sqrt(centre.covariance[0]), Math.sqrt(centre.covariance[2])];
}

function centreOf(side: Side, feature: Feature, index: number): Centre {
  const [su, sv] = vec2(feature.sd_px);
  return {
    key: `f${index}`,
    side,
    pixel: [feature.x, feature.y],
    covariance: [su * su, (feature.correlation ?? 0) * su * sv, sv * sv],
    feature: index,
    score: feature.score,
    manual: feature.manual ?? false,
    triad: null,
    ball: null,
    reason: null,
  };
}

/** Give the features of the chosen candidates of a pair to their triads. */
function claimChosen(scene: Scene, candidates: StageCandidates | null): void {
  const points = candidates?.explanation?.points ?? [];
  for (const candidate of candidates?.explanation?.triads ?? []) {
    const triad = candidate.triad === null ? undefined : scene.triads[candidate.triad];
    if (triad === undefined || candidate.reason !== null) continue;
    candidate.balls.forEach((name, k) => {
      const point = points.find((one) => one.left === candidate.left[k] && one.right === candidate.right[k]);
      for (const side of SIDES) {
        const centre = scene[side][candidate[side][k] ?? -1];
        const ball = triad.balls.find((known) => known.name === name);
        if (centre === undefined || ball === undefined) continue;
        ball[side] = centre.key;
        ball.parallaxMm = point?.parallax_mm ?? null;
        [centre.triad, centre.ball, centre.reason] = [triad.index, name, null];
      }
    });
  }
}

/** Give the centre of a ball to its triad, and return its key. */
function claimed(
  scene: Scene,
  side: Side,
  pixel: readonly number[] | null,
  triad: number,
  ball: string,
  manual: readonly string[],
): string | null {
  if (pixel === null) return null;
  const place = vec2(pixel);
  let centre = scene[side].find((candidate) => distance2(candidate.pixel, place) < SAME_PX);
  if (centre === undefined) {
    const none = { covariance: null, feature: null, score: null, reason: null };
    centre = { key: `b${triad}${ball}`, side, pixel: place, manual: manual.includes(side), triad, ball, ...none };
    scene[side].push(centre);
  }
  centre.triad = triad;
  centre.ball = ball;
  centre.reason = null;
  return centre.key;
}
