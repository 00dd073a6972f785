"""Comparison of detected features with the true centres of balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from bench.balls import CLEAR, BallScene
from bench.contenders import Contender, Positions, find_balls
from bench.scoring import FEATURE_PX, rms
from bench.speed import milliseconds
from spinewatch.arrays import Bool, Float
from spinewatch.detection.candidates.search import Detection
from spinewatch.imaging.frame import SIDES, Side

BUDGETS = (20, 40, 60, 100)
COMPARED_AT = 60
"""Features per image at which centres are compared."""
SURE_PX = 0.2
"""A centre is sure when its stated standard deviation along both axes is less than this."""


@dataclass(frozen=True, eq=False)
class Score:
    """The score of a contender.

    ``recall`` at each budget, 0 to 1; ``features`` per image and ``rms_px`` (u, v) of the centres of found balls at 60
    features; median ``ms`` per pair.
    """

    recall: tuple[float, ...]
    features: float
    rms_px: tuple[float, float]
    ms: float


@dataclass(frozen=True, eq=False)
class FoundScene:
    """Our refined detections in a scene."""

    balls: BallScene
    left: Detection
    right: Detection

    @property
    def detections(self) -> tuple[Detection, Detection]:
        """Left and right."""
        return self.left, self.right


@dataclass(frozen=True, eq=False)
class BallErrors:
    """Error (n, 2) and stated standard deviation (n, 2) of every visible ball's centre, px; infinite where not found.

    ``left`` (n,): balls of left views; ``clear`` (n,): balls whose outline is visible except for a tenth at most.
    """

    error_px: Float
    sd_px: Float
    left: Bool
    clear: Bool

    def of_side(self, side: Side) -> BallErrors:
        """Return those of one side."""
        of = self.left == (side == "left")
        return BallErrors(self.error_px[of], self.sd_px[of], self.left[of], self.clear[of])


@dataclass(frozen=True)
class Centres:
    """Sure balls, and their share, 0 to 1, of the clear ones; RMS and mean of the error (u, v) of sure balls, px.

    ``chi2``: mean of squared error over stated variance of sure balls; 1 is expected.
    """

    clear: int
    sure: int
    sure_share: float
    rms_px: tuple[float, float]
    bias_px: tuple[float, float]
    chi2: float


def score(contender: Contender, scenes: Sequence[BallScene]) -> Score:
    """Return a contender's score over all scenes, each timed once after a warm-up."""
    contender.find(scenes[0], max(BUDGETS))
    runs = [_run(contender, scene) for scene in scenes]
    recall: list[float] = []
    for budget in BUDGETS:
        offsets = [
            nearest(view.centres_px[view.visible], xy)[0]
            for scene, (positions, _) in zip(scenes, runs, strict=True)
            for view, xy in zip(scene.views, positions[budget], strict=True)
        ]
        offset = np.concatenate(offsets)
        hit = np.linalg.norm(offset, axis=1) < FEATURE_PX
        recall.append(float(hit.mean()))
        if budget == COMPARED_AT:
            u, v = offset[hit].T
            features = float(np.mean([len(xy) for positions, _ in runs for xy in positions[budget]]))
    return Score(tuple(recall), features, (rms(u), rms(v)), median(ms for _, ms in runs))


def _run(contender: Contender, scene: BallScene) -> tuple[dict[int, Positions], float]:
    """Return the positions by budget, and the milliseconds of finding 60 features, or all when these are ranked."""
    found: dict[int, Positions] = {}

    def search(budget: int) -> float:
        return milliseconds(lambda: found.update({budget: contender.find(scene, budget)}))

    if not contender.ranked:
        times = {budget: search(budget) for budget in BUDGETS}
        return {budget: _first(found[budget], budget) for budget in BUDGETS}, times[COMPARED_AT]
    largest = max(BUDGETS)
    ms = search(largest)
    return {budget: _first(found[largest], budget) for budget in BUDGETS}, ms


def find(scene: BallScene) -> FoundScene:
    """Return our refined detections in a scene."""
    return FoundScene(scene, *find_balls(scene))


def nearest(centres_px: Float, xy_px: Float) -> tuple[Float, NDArray[np.intp]]:
    """Return for each centre (n, 2) the offset (n, 2) of the feature (m, 2) nearest to it, and its index (n,).

    Without features offsets are infinite and indices 0.
    """
    if not len(xy_px):
        return np.full(centres_px.shape, np.inf), np.zeros(len(centres_px), dtype=np.intp)
    index = np.linalg.norm(centres_px[:, None] - xy_px, axis=2).argmin(axis=1)
    return xy_px[index] - centres_px, index


def centre_errors(scenes: Sequence[FoundScene]) -> BallErrors:
    """Return the centre errors of all visible balls, each against the nearest of the first 60 features."""
    error, sd, left, clear = [], [], [], []
    for scene in scenes:
        for side, view, detection in zip(SIDES, scene.balls.views, scene.detections, strict=True):
            error_px, index = nearest(view.centres_px[view.visible], detection.features.xy_px[:COMPARED_AT])
            found = np.linalg.norm(error_px, axis=1) < FEATURE_PX
            stated_px = np.full(error_px.shape, np.inf)
            variance = detection.features.covariance_px2[:, [0, 1], [0, 1]]
            stated_px[found] = np.sqrt(variance[index[found]])
            error.append(np.where(found[:, None], error_px, np.inf))
            sd.append(stated_px)
            left.append(np.full(len(error_px), side == "left"))
            clear.append(view.fraction[view.visible] > CLEAR)
    return BallErrors(*map(np.concatenate, (error, sd, left, clear)))


def centres(errors: BallErrors) -> Centres:
    """Return the errors of the sure centres; NaN where there are none."""
    sure = (errors.sd_px < SURE_PX).all(axis=1)
    e, sd = errors.error_px[sure], errors.sd_px[sure]
    bias = e.mean(axis=0) if sure.any() else np.full(2, np.nan)
    return Centres(
        clear=int(errors.clear.sum()),
        sure=int(sure.sum()),
        sure_share=float((sure & errors.clear).sum() / max(errors.clear.sum(), 1)),
        rms_px=(rms(e[:, 0]), rms(e[:, 1])),
        bias_px=(float(bias[0]), float(bias[1])),
        chi2=rms(e / sd) ** 2,
    )


def _first(positions: Positions, budget: int) -> Positions:
    return positions[0][:budget], positions[1][:budget]
