/** What the images, tables and lines of the workspace are drawn from. */
import { useMemo } from "preact/hooks";

import type { Stage, Surgery } from "../api/types";
import { otherSide, type Rig, rigOf, SIDES } from "./camera";
import { compared, type Comparison } from "./comparison";
import { pairsOf, type TakeDocuments } from "./documents";
import { type Draft, edited, type EditedScene } from "./draft";
import { ellipse95, enlargement } from "./ellipses";
import { epipolarParameters, ranges } from "./epipolar";
import { epipolarView, type EpipolarView } from "./epipolar-view";
import { type Centre, type Scene, sceneOf } from "./scene";

export interface SceneState {
  /** As it was measured, and with the correction. */
  base: Scene;
  scene: EditedScene;
  rig: Rig;
  ballDiameterMm: number;
  /** With the take that is compared; null without one. */
  comparison: Comparison | null;
  epipolarOf: (centre: Centre | null) => EpipolarView | null;
}

/** The scene of a take with its correction. */
export function useScene(
  surgery: Surgery,
  shown: Stage,
  documents: TakeDocuments,
  earlier: TakeDocuments | null,
  draft: Draft,
): SceneState {
  const isBurst = pairsOf(shown) > 1;
  const joined = ({ triads, features, candidates }: TakeDocuments): Scene =>
    sceneOf(triads, features, candidates, surgery.vertebrae, isBurst);
  const base = useMemo(() => joined(documents), [documents.triads, documents.features, documents.candidates]);
  const scene = useMemo(() => edited(base, draft), [base, draft]);
  const rig = useMemo(() => rigOf(documents.calibration.rig), [documents.calibration]);
  const parameters = useMemo(() => epipolarParameters(documents.triads.parameters), [documents.triads]);
  const limits = useMemo(() => ranges(rig, parameters), [rig, parameters]);
  const comparison = useMemo(() => (earlier === null ? null : compared(joined(earlier), base)), [earlier, base]);
  return {
    base,
    scene,
    rig,
    ballDiameterMm: Number(documents.triads.parameters["ball_diameter_mm"] ?? 8),
    comparison,
    epipolarOf: (centre) =>
      centre === null ? null : epipolarView(rig, limits, parameters, centre, scene[otherSide(centre.side)]),
  };
}

/** The factor by which the ellipses of a scene are enlarged, so that they are seen at this zoom. */
export function ellipseFactor(scene: Scene, zoom: number): number {
  const ellipses = SIDES.flatMap((side) =>
    scene[side].flatMap((centre) =>
      centre.triad === null || centre.covariance === null ? [] : (ellipse95(centre.covariance) ?? []),
    ),
  );
  return enlargement(ellipses, zoom);
}
