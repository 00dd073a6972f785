"""Errors of the published detector's centres, from which the deviations of `process --method thesis-1995` follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bench.balls import BallScene, BallView, find_ball_scenes
from bench.contenders import PUBLISHED, WHOLE_IMAGE
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.imaging.frame import Frame
from spinewatch.pipeline_1995 import PublishedMeasurer, PublishedParameters
from spinewatch.stage import StageRequest
from spinewatch.thesis_1995.detect_point import DetectPointParameters, detect_point

BUDGETS = (15, 30, 60)
REACH_PX = 2.5
"""A feature nearer than this to the centre of a visible ball is that of the ball."""

NEAR_MM = 8.0
"""A triad farther than this from every true one is none."""

MAX_RATIO = 2.0
"""Largest ratio of the errors of triads to their deviations: a ball whose feature is displaced is not recognized."""

DETECTORS = {"as published": PUBLISHED, "whole image": WHOLE_IMAGE}


@dataclass
class _Errors:
    """Errors of centres (n, 2) and means of those of the three balls of a triad (t, 2), as fractions of the ball."""

    single: list[Float] = field(default_factory=list)
    of_triads: list[Float] = field(default_factory=list)


def part(directory: Path) -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the errors of centres and of triads beside their stated deviations, and the bars on them."""
    scenes = list(find_ball_scenes(directory))
    centres, bar = _centres(scenes)
    triads, further = _triads(scenes)
    return [centres, triads], [bar, *further]


def _centres(scenes: Sequence[BallScene]) -> tuple[Grid, Bar]:
    rows, greatest = [], np.zeros(2)
    for name, parameters in DETECTORS.items():
        for budget in BUDGETS:
            errors = _Errors()
            for scene in scenes:
                for view in scene.views:
                    _collect(errors, view, replace(parameters, expected_features=budget))
            rms, shared = (
                np.sqrt(np.mean(np.square(values), axis=0)) for values in (errors.single, errors.of_triads)
            )
            greatest = np.maximum(greatest, rms)
            common = np.sqrt((shared**2 - rms**2 / 3).clip(0) * 3 / 2)
            rows.append(
                (name, str(budget), str(len(errors.single)), *(_text(x, scenes[0]) for x in (rms, common)))
            )
    stated = np.array(PUBLISHED.sigma_balls)
    rows.append(("stated", "", "", _text(stated, scenes[0]), "0.15 along u"))
    grid = Grid.of(
        f"RMS errors of DETECT-POINT's centres within {REACH_PX} px of a ball, and the part that a triad's balls share",
        ["detector", "features expected", "centres", "u, v, px of the first scene", "shared, px"],
        rows,
    )
    return grid, Bar(
        "centre errors of DETECT-POINT at most as stated",
        f"{_text(greatest, scenes[0])}, stated {_text(stated, scenes[0])} px",
        bool(np.all(greatest <= stated)),
    )


def _collect(errors: _Errors, view: BallView, parameters: DetectPointParameters) -> None:
    found = detect_point(Frame(view.image, view.side), view.ball_px, parameters).features.xy_px
    if not len(found):
        return
    offset = found[None] - view.centres_px[:, None]
    nearest = np.linalg.norm(offset, axis=2).argmin(axis=1)
    error = offset[np.arange(len(nearest)), nearest]
    near = (np.linalg.norm(error, axis=1) < REACH_PX) & view.visible
    error = error / view.ball_px
    errors.single += list(error[near])
    for first in range(0, len(error), 3):
        if near[first : first + 3].all():
            errors.of_triads.append(error[first : first + 3].mean(axis=0))


def _text(fractions: Float, scene: BallScene) -> str:
    return ", ".join(f"{x:.2f}" for x in fractions * scene.left.ball_px)


def _triads(scenes: Sequence[BallScene]) -> tuple[Grid, list[Bar]]:
    rows, worst, missing = [], 0.0, 0
    published = PublishedParameters()
    for name, detection in DETECTORS.items():
        parameters = replace(published, detection=detection, sets=replace(published.sets, refine=False))
        errors, ratios, wrong, placed = [], [], 0, 0
        for scene in scenes:
            left, right = (Frame(view.image, view.side) for view in scene.views)
            true = np.stack([triad.position_mm for triad in scene.scene.triads])
            placed += len(true)
            request = StageRequest(triads=len(true))
            found = PublishedMeasurer(scene.scene.rig, parameters).measure(left, right, request)
            for triad in found.triads:
                pose = triad.triad.pose
                assert pose is not None  # noqa: S101 - both images show all balls
                off = pose.position_mm - true
                nearest = int(np.linalg.norm(off, axis=1).argmin())
                if np.linalg.norm(off[nearest]) > NEAR_MM:
                    wrong += 1
                    continue
                errors.append(off[nearest])
                ratios.append(off[nearest] / pose.position_sd_mm)
        if not errors:
            missing += 1
            continue
        rms, ratio = (np.sqrt(np.mean(np.square(values), axis=0)) for values in (errors, ratios))
        worst = max(worst, float(ratio.max()))
        rows.append(
            (name, f"{len(errors)} of {placed}", str(wrong), *(" ".join(f"{x:.2f}" for x in v) for v in (rms, ratio)))
        )  # fmt: skip
    grid = Grid.of(
        "Triads of `process --method thesis-1995 --no-refine`: errors of P, and their ratio to the stated deviations",
        ["detector", "triads found", "wrong ones", "RMS error X Y Z mm", "RMS error / deviation"],
        rows,
    )
    return grid, [
        Bar(
            f"errors of triads at most {MAX_RATIO:g} of their deviations",
            f"{worst:.2f}",
            worst <= MAX_RATIO and not missing,
        )
    ]
