"""The balls of rendered scenes, view by view."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.truth import Scene, find_scenes
from spinewatch.arrays import Bool, Float, Pixels
from spinewatch.camera import Camera
from spinewatch.detection.detector import nominal_ball_px
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Side
from spinewatch.matching.epipolar import nominal_ranges_mm
from spinewatch.parameters import Parameters

CLEAR = 0.9
"""A ball is clear when more than this fraction of its outline is visible."""


@dataclass(frozen=True, eq=False)
class BallView:
    """One image (H, W) of a scene and the placed balls in it.

    Nominal ``ball_px`` (width, height) and ``range_mm``; true ``centres_px`` (n, 2); which balls are ``visible`` (n,),
    that is at least half of their outline, and the visible ``fraction`` (n,).
    """

    side: Side
    image: Pixels
    camera: Camera
    ball_px: tuple[float, float]
    range_mm: float
    centres_px: Float
    visible: Bool
    fraction: Float


@dataclass(frozen=True, eq=False)
class BallScene:
    """Both views of a scene."""

    scene: Scene
    left: BallView
    right: BallView

    @property
    def views(self) -> tuple[BallView, BallView]:
        """Left and right."""
        return self.left, self.right


def find_ball_scenes(root: Path) -> Iterator[BallScene]:
    """Yield every scene with triads under ``root``, in the order of their folders."""
    for scene in find_scenes(root):
        yield read_ball_scene(scene)


def read_ball_scene(scene: Scene) -> BallScene:
    """Return both views of a scene with the true balls."""
    truth = json.loads((scene.folder / "truth.json").read_text(encoding="utf-8"))
    balls = [ball for triad in truth["triads"] for ball in triad["balls"].values()]
    parameters = Parameters()
    ranges = nominal_ranges_mm(scene.rig, parameters.search.matching.epipolar)
    sizes = nominal_ball_px(scene.rig, ranges, parameters.ball_diameter_mm)
    left, right = (
        BallView(
            side=side,
            image=decode_image((scene.folder / f"{side}.png").read_bytes()),
            camera=camera,
            ball_px=size,
            range_mm=range_mm,
            centres_px=np.array([ball[side]["center_px"] for ball in balls]),
            visible=np.array([ball[side]["visible"] for ball in balls], dtype=bool),
            fraction=np.array([ball[side]["visible_fraction"] for ball in balls]),
        )
        for side, camera, size, range_mm in zip(
            SIDES, (scene.rig.left, scene.rig.right), sizes, ranges, strict=True
        )
    )
    return BallScene(scene, left, right)
