"""Section 7.2: candidate sets refined by a look-up into decision space instead of the correlation of surroundings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import process_time

import numpy as np

from bench.balls import BallScene, BallView, find_ball_scenes
from bench.contenders import WHOLE_IMAGE
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.imaging.frame import Frame
from spinewatch.thesis_1995.candidate_sets import (
    CandidateSetParameters,
    CandidateSets,
    candidate_sets,
    feature_windows,
    near_greatest,
)
from spinewatch.thesis_1995.detect_point import DetectPoint, detect_point

REACH_PX = 1.5
RATIOS = (0.5, 0.8, 0.9, 0.95)
FEATURES = 60
"""Features expected in an image, so that candidate sets have false members."""

_PARAMETERS = CandidateSetParameters()
_CHANCE = 0.1


@dataclass
class _Tally:
    """Pairs and true pairs before and after the refinement, and the time that the similarities take, s."""

    seconds: float = 0.0
    before: int = 0
    true_before: int = 0
    after: dict[float, int] = field(default_factory=lambda: dict.fromkeys(RATIOS, 0))
    true_after: dict[float, int] = field(default_factory=lambda: dict.fromkeys(RATIOS, 0))

    def kept(self, ratio: float) -> float:
        """Return the fraction of true matches that remain."""
        return self.true_after[ratio] / self.true_before

    def discarded(self, ratio: float) -> float:
        """Return the fraction of false pairs that are discarded."""
        false = self.before - self.true_before
        return 1 - (self.after[ratio] - self.true_after[ratio]) / false


Similar = Callable[[BallScene, tuple[DetectPoint, DetectPoint]], Float]


def part(directory: Path) -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the figures of both refinements, and the bars on them."""
    tallies = {name: _Tally() for name in SIMILARITIES}
    for scene in find_ball_scenes(directory):
        left, right = (_detected(view) for view in scene.views)
        sets = candidate_sets(
            left.features.rays(scene.scene.rig.left), right.features.rays(scene.scene.rig.right),
            scene.scene.rig, _PARAMETERS,
        )  # fmt: skip
        balls = [_balls(view, found.features) for view, found in zip(scene.views, (left, right), strict=True)]
        same = (balls[0][:, None] == balls[1][None]) & (balls[0][:, None] >= 0)
        for name, similar in SIMILARITIES.items():
            start = process_time()
            rho = similar(scene, (left, right))
            tallies[name].seconds += process_time() - start
            _count(tallies[name], sets, rho, same)
    rows = [
        (name, f"{ratio:g}", f"{tally.kept(ratio):.0%}", f"{tally.discarded(ratio):.0%}",
         f"{tally.kept(ratio) + tally.discarded(ratio) - 1:+.2f}")
        for name, tally in tallies.items() for ratio in RATIOS
    ]  # fmt: skip
    area, look = tallies.values()
    grid = Grid.of(
        f"Section 7.2: eq. 5.11 by either similarity, {area.before} candidate pairs, {area.true_before} of them true;"
        f" processor time {area.seconds * 1e3:.0f} and {look.seconds * 1e3:.1f} ms in all",
        ["similarity", "fraction of the greatest", "true pairs kept", "false pairs discarded", "sum - 1"],
        rows,
    )
    gains = {name: max(t.kept(r) + t.discarded(r) - 1 for r in RATIOS) for name, t in tallies.items()}
    area_gain, look_gain = gains.values()
    return [grid], [
        Bar(
            "the look-up is at least ten times faster",
            f"{area.seconds / max(look.seconds, 1e-9):.0f} times",
            10 * look.seconds < area.seconds,
        ),
        Bar(
            "but it tells true pairs from false ones no better than chance, whose sum is 1: refused",
            f"best sum less 1: {look_gain:+.2f}; correlation {area_gain:+.2f}",
            look_gain < _CHANCE and look_gain < area_gain,
        ),
    ]


def _detected(view: BallView) -> DetectPoint:
    parameters = replace(WHOLE_IMAGE, expected_features=FEATURES)
    return detect_point(Frame(view.image, view.side), view.ball_px, parameters)


def _balls(view: BallView, features: Features) -> np.ndarray:
    """Return the ball of each feature (n,), -1 for a false feature."""
    distance = np.linalg.norm(features.xy_px[:, None] - view.centres_px[None], axis=2)
    nearest = distance.argmin(axis=1)
    return np.where(distance.min(axis=1) < REACH_PX, nearest, -1)


def _count(tally: _Tally, sets: CandidateSets, rho: Float, same: np.ndarray) -> None:
    tally.before += int(sets.pairs.sum())
    tally.true_before += int((sets.pairs & same).sum())
    for ratio in RATIOS:
        refined = CandidateSets(
            sets.of_left & near_greatest(rho, sets.of_left, 1, ratio),
            sets.of_right & near_greatest(rho, sets.of_right, 0, ratio),
        ).pairs
        tally.after[ratio] += int(refined.sum())
        tally.true_after[ratio] += int((refined & same).sum())


def _area(scene: BallScene, found: tuple[DetectPoint, DetectPoint]) -> Float:
    left, right = (
        feature_windows(view.image, one.features.xy_px, _PARAMETERS.window_px)
        for view, one in zip(scene.views, found, strict=True)
    )
    return np.asarray(left @ right.T)


def _look_up(_: BallScene, found: tuple[DetectPoint, DetectPoint]) -> Float:
    """Return the ratios (n, m) of the values of the feature space at both features, the smaller to the larger."""
    a, b = (one.feature_space[tuple(_pixels(one).T)] for one in found)
    return np.asarray(np.minimum(a[:, None], b[None]) / np.maximum(np.maximum(a[:, None], b[None]), 1e-9))


def _pixels(found: DetectPoint) -> np.ndarray:
    """Return row and column (n, 2) of each feature in the feature space."""
    u, v = np.rint(found.features.xy_px).astype(int).T
    height, width = found.feature_space.shape
    return np.column_stack([(v - found.preprocessed.rows[0]).clip(0, height - 1), u.clip(0, width - 1)])


SIMILARITIES: Mapping[str, Similar] = {
    "correlation, 75 x 75 px": _area,
    "look-up into decision space": _look_up,
}
