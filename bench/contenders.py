"""The detectors that are compared on the same scenes: Spinewatch, the published method, and general ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from typing import TypeVar

import numpy as np

from bench.balls import BallScene, BallView
from bench.peers_detection import PEERS, Detector
from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.candidates.search import Detection, DetectionParameters, detect
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.tone import to_gray
from spinewatch.parallel import both
from spinewatch.pipeline import StageMeasurer
from spinewatch.thesis_1995.detect_point import DetectPointParameters, detect_point
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters

Result = TypeVar("Result")

Positions = tuple[Float, Float]
"""Positions (n, 2), px, in the left and in the right image, best first."""

PUBLISHED = DetectPointParameters()
"""DETECT-POINT as published; its size reduction keeps a part of the wound in several of the scenes."""

WHOLE_IMAGE = replace(PUBLISHED, preprocessing=PreprocessingParameters(statistic=None))
"""Without size reduction."""

ROOTS = replace(WHOLE_IMAGE, root_threshold=None)
"""The relaxed mode of section 7.2."""

IN_FIELD = ("soft disc, normalized", "soft disc, not normalized")


@dataclass(frozen=True)
class Contender:
    """A detector of the balls of a scene, given a number of features per image.

    ``ranked``: its first n features are those of a search for n, so that one run serves all numbers.
    """

    find: Callable[[BallScene, int], Positions]
    ranked: bool = True


def contenders(fields: Mapping[BallView, SurgicalField]) -> dict[str, Contender]:
    """Return all contenders by name; two of them search only the surgical ``fields`` of the views."""
    ready_made = {name: Contender(_of_views(detector)) for name, detector in PEERS.items()}
    in_field = {f"{name}, in our field": Contender(_of_views(PEERS[name], fields)) for name in IN_FIELD}
    return {
        "Spinewatch": Contender(lambda scene, _: _positions(find_balls(scene))),
        "Spinewatch, centres not refined": Contender(_detector(DetectionParameters())),
        "thesis 1995": Contender(_published(PUBLISHED), ranked=False),
        "thesis 1995, whole image": Contender(_published(WHOLE_IMAGE), ranked=False),
        "thesis 1995, whole image, roots only": Contender(_published(ROOTS), ranked=False),
        **ready_made,
        **in_field,
    }


def find_balls(scene: BallScene) -> tuple[Detection, Detection]:
    """Return the detections of both views with refined centres, as the pipeline makes them."""
    left, right = (Frame(view.image, view.side) for view in scene.views)
    return _measurer(scene.scene.rig).detect(left, right)


@cache
def _measurer(rig: Rig) -> StageMeasurer:
    return StageMeasurer(rig, pool=ThreadPoolExecutor(max_workers=1))


def _detect(view: BallView, parameters: DetectionParameters) -> Detection:
    return detect(Frame(view.image, view.side), view.ball_px, parameters)


def _detector(parameters: DetectionParameters) -> Callable[[BallScene, int], Positions]:
    def find(scene: BallScene, budget: int) -> Positions:
        wanted = replace(parameters, max_features=budget)
        return _positions(_in_both_views(lambda view: _detect(view, wanted), scene))

    return find


def _published(parameters: DetectPointParameters) -> Callable[[BallScene, int], Positions]:
    def find(scene: BallScene, budget: int) -> Positions:
        wanted = replace(parameters, expected_features=budget)
        left, right = _in_both_views(
            lambda view: detect_point(Frame(view.image, view.side), view.ball_px, wanted), scene
        )
        return left.features.xy_px, right.features.xy_px

    return find


def _positions(found: tuple[Detection, Detection]) -> Positions:
    return found[0].features.xy_px, found[1].features.xy_px


def _of_views(
    detector: Detector, fields: Mapping[BallView, SurgicalField] | None = None
) -> Callable[[BallScene, int], Positions]:
    def find(view: BallView) -> Float:
        h, w = view.image.shape
        box = fields[view] if fields else SurgicalField(0, 0, w, h)
        part = to_gray(view.image)[box.v0 : box.v1, box.u0 : box.u1]
        return np.asarray(detector(part, view.ball_px) + np.array([box.u0, box.v0]))

    return lambda scene, _: _in_both_views(find, scene)


def _in_both_views(function: Callable[[BallView], Result], scene: BallScene) -> tuple[Result, Result]:
    with ThreadPoolExecutor(max_workers=1) as pool:
        return both(function, *scene.views, pool)
