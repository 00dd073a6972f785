"""The detectors that are compared on the same scenes: ours, the published method and its steps, ready-made ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.balls import BallScene, BallView
from bench.peers_detection import PEERS, Detector
from spinewatch.arrays import Float
from spinewatch.detection.candidates.search import THESIS_1995, Detection, DetectionParameters, detect
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.imaging.exposure import to_gray
from spinewatch.parallel import both
from spinewatch.pipeline import Parameters
from spinewatch.pipeline import find_balls as find_balls_of_pair

ChainCandidates = tuple[Float, Float]
"""ChainCandidates (n, 2) in the left and in the right image, best first."""

ROOTS = replace(
    THESIS_1995,
    comparisons=tuple(replace(c, gate=None) for c in THESIS_1995.comparisons),
    segmentation="peaks",
    score_floor=0.0,
)
"""The published property spaces in the relaxed mode of section 7.2, with local maxima for components."""

IN_FIELD = ("soft disc, normalised", "soft disc, not normalised")


@dataclass(frozen=True)
class Contender:
    """A way to find the balls of a scene, given a number of features an image.

    ``ranked``: fewer features are the first of more, so that one run serves all numbers.
    """

    find: Callable[[BallScene, int], ChainCandidates]
    ranked: bool = True


def contenders(fields: Mapping[BallView, SurgicalField]) -> dict[str, Contender]:
    """Return all contenders by name; some are told the surgical ``fields`` of the views."""
    ready_made = {name: Contender(_of_views(detector)) for name, detector in PEERS.items()}
    told = {f"{name}, in our field": Contender(_of_views(PEERS[name], fields)) for name in IN_FIELD}
    return {
        "Spinewatch": Contender(lambda scene, _: _places(find_balls(scene))),
        "Spinewatch, centres not refined": Contender(_detector(DetectionParameters())),
        "thesis 1995": Contender(_detector(THESIS_1995), ranked=False),
        "thesis 1995, roots only, local maxima": Contender(_detector(ROOTS)),
        **ready_made,
        **told,
    }


def find_balls(scene: BallScene) -> tuple[Detection, Detection]:
    """Return the detections of both views with refined centres, as the pipeline makes them."""
    rig = scene.scene.rig
    return find_balls_of_pair((scene.left.image, scene.right.image), rig, Parameters())


def _detect(view: BallView, parameters: DetectionParameters) -> Detection:
    return detect(view.image, view.side, view.ball_px, parameters)


def _detector(parameters: DetectionParameters) -> Callable[[BallScene, int], ChainCandidates]:
    def find(scene: BallScene, budget: int) -> ChainCandidates:
        wanted = replace(parameters, budget=budget)
        return _places(both(lambda view: _detect(view, wanted), *scene.views))

    return find


def _places(found: tuple[Detection, Detection]) -> ChainCandidates:
    return found[0].features.xy_px, found[1].features.xy_px


def _of_views(
    detector: Detector, fields: Mapping[BallView, SurgicalField] | None = None
) -> Callable[[BallScene, int], ChainCandidates]:
    def look(view: BallView) -> Float:
        h, w = view.image.shape
        box = fields[view] if fields else SurgicalField(0, 0, w, h)
        part = to_gray(view.image)[box.v0 : box.v1, box.u0 : box.u1]
        return np.asarray(detector(part, view.ball_px) + np.array([box.u0, box.v0]))

    return lambda scene, _: both(look, *scene.views)
