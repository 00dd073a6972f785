/** Documents of a take with two triads, of which one has a hidden ball, as the API sends them. */
import type { Feature, StageCandidates, StageFeatures, StageTriads, Triad } from "../../src/api/types";

type Place = [number, number];

const LEFT: Place[] = [[225, 168], [207, 190], [194, 175], [275, 164], [273, 195], [486, 220]];
const RIGHT: Place[] = [[177, 185], [167, 206], [152, 193], [220, 177], [222, 207], [205, 206], [440, 240]];

function feature([x, y]: Place): Feature {
  return { x, y, score: 0.8, sd_px: [0.1, 0.1], correlation: 0.5, visible_fraction: 0.9, manual: false };
}

function triad(label: string, position: number[], left: (Place | null)[], right: (Place | null)[]): Triad {
  const names = ["XX", "YY", "MX"];
  return {
    label,
    label_reason: null,
    label_manual: false,
    model: "flat-10-14-18",
    reason: null,
    position_mm: position,
    position_sd_mm: [0.1, 0.1, 0.2],
    normal: [0, 0, 1],
    angles_deg: [90, 90, 0],
    rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    rotation_sd_deg: [0.5, 0.5, 0.5],
    covariance: Array.from({ length: 6 }, (_, i) => Array.from({ length: 6 }, (_, j) => (i === j ? 0.01 : 0))),
    error_mm: 0.1,
    balls: Object.fromEntries(
      names.map((name, k) => [
        name,
        {
          position_mm: position.map((value) => value + k),
          sd_mm: [0.1, 0.1, 0.2],
          left: left[k] ?? null,
          right: right[k] ?? null,
          parallax_mm: left[k] == null ? null : 0.1,
          manual: [],
        },
      ]),
    ),
  };
}

export function triadsDocument(): StageTriads {
  return {
    surgery_id: "s",
    stage: "PRE",
    take: 3,
    frame: "object space of calibration cart 1",
    triads: [
      triad("L1", [100, 200, 50], LEFT.slice(0, 3), RIGHT.slice(0, 3)),
      triad("T11", [150, 190, 55], [LEFT[3] ?? null, LEFT[4] ?? null, null], RIGHT.slice(3, 6)),
    ],
    flags: [],
    parameters: { ball_diameter_mm: 8 },
    templates: "2026.1",
    version: "0.3.0",
  };
}

export function featuresDocument(): StageFeatures {
  return {
    surgery_id: "s",
    stage: "PRE",
    take: 3,
    fields: { left: [0, 0, 568, 416], right: [0, 0, 568, 416] },
    exposure: { left: "normal", right: "normal" },
    features: { left: LEFT.map(feature), right: RIGHT.map(feature) },
    pair: 1,
  };
}

/** The chosen candidate names the balls of the first triad in another order than the triad does. */
export function candidatesDocument(): StageCandidates {
  const use = (ball: string | null) => ({ candidate: ball === null ? null : 0, ball, reason: null });
  const none = { candidate: null, ball: null, reason: "no-partner" as const };
  return {
    surgery_id: "s",
    stage: "PRE",
    take: 3,
    pair: 1,
    explanation: {
      method: "default",
      left: { features: [use("MX"), use("YY"), use("XX"), use("XX"), use("YY"), none], discarded: [] },
      right: { features: [use("XX"), use("YY"), use("MX"), use(null), use(null), use(null), none], discarded: [] },
      points: [],
      points_left_out: 0,
      triads: [
        {
          model: "flat-10-14-18",
          balls: ["XX", "YY", "MX"],
          left: [2, 1, 0],
          right: [0, 1, 2],
          position_mm: [100, 200, 50],
          error_mm: 0.1,
          log_odds: 17,
          triad: 0,
          reason: null,
          heuristic: null,
          rival: null,
        },
        {
          model: "flat-10-14-18",
          balls: ["XX", "YY", "MX"],
          left: [3, 4, null],
          right: [3, 4, 5],
          position_mm: [150, 190, 55],
          error_mm: 0.4,
          log_odds: 2,
          triad: null,
          reason: "point-taken",
          heuristic: "H2",
          rival: 0,
        },
      ],
      triads_left_out: 0,
    },
  };
}
