"""The balls of rendered scenes, view by view."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.truth import SIDES, Scene, find_scenes
from spinewatch.arrays import Float, Pixels
from spinewatch.camera import Camera
from spinewatch.detection.candidates.templates import Side
from spinewatch.imaging.decoding import decode_image
from spinewatch.pipeline import Parameters, nominal_ball_px, nominal_ranges_mm

CLEAR = 0.9
"""A ball counts as unhidden when more than this fraction of its outline is seen."""


@dataclass(frozen=True, eq=False)
class BallView:
    """One image (H, W) of a scene and what it shows of the placed balls.

    Nominal ``ball_px`` (width, height) and ``range_mm``; true ``centres_px`` (n, 2), whether each ball is
    ``seen`` (n,) (at least half of it), and which ``fraction`` (n,) of it.
    """

    side: Side
    image: Pixels
    camera: Camera
    ball_px: tuple[float, float]
    range_mm: float
    centres_px: Float
    seen: NDArray[np.bool_]
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
    """Return both views of a scene with the truth about their balls."""
    truth = json.loads((scene.folder / "truth.json").read_text(encoding="utf-8"))
    balls = [ball for triad in truth["triads"] for ball in triad["balls"].values()]
    sizes = nominal_ball_px(scene.rig, Parameters())
    ranges = nominal_ranges_mm(scene.rig, Parameters())
    left, right = (
        BallView(
            side=side,
            image=decode_image((scene.folder / f"{side}.png").read_bytes()),
            camera=camera,
            ball_px=size,
            range_mm=away,
            centres_px=np.array([ball[side]["center_px"] for ball in balls]),
            seen=np.array([ball[side]["visible"] for ball in balls], dtype=bool),
            fraction=np.array([ball[side]["visible_fraction"] for ball in balls]),
        )
        for side, camera, size, away in zip(
            SIDES, (scene.rig.left, scene.rig.right), sizes, ranges, strict=True
        )
    )
    return BallScene(scene, left, right)
