"""Time and memory of detection: both views of a pair, features and refined centres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import cast

import cv2
import numpy as np

from bench.balls import BallScene, BallView, find_ball_scenes
from bench.contenders import find_balls
from bench.speed import cut_templates, match_masked, milliseconds
from spinewatch.arrays import Pixels
from spinewatch.camera import Camera
from workers.memory import keep_freed_memory

SAMPLES = Path(__file__).parents[1] / "samples"
SIZES = ((568, 416), (1136, 832), (1920, 1408))
RUNS = 20

_CLEAR_PEAK = "5"
"""Written to ``clear_refs`` of a process it resets its peak memory."""


@dataclass(frozen=True, eq=False)
class Cost:
    """Milliseconds per pair of each size (W, H), of the peer at the smallest, and peak memory at the largest."""

    ms: Mapping[tuple[int, int], Sequence[float]]
    peer_ms: Sequence[float]
    memory_mb: float

    @property
    def times_faster(self) -> float:
        """Median ratio of the peer's time to ours, run by run."""
        return median(peer / ours for peer, ours in zip(self.peer_ms, self.ms[SIZES[0]], strict=True))

    @property
    def ns_per_pixel(self) -> dict[tuple[int, int], float]:
        """Median nanoseconds per pixel of both images, by size (W, H)."""
        return {(w, h): median(ms) * 1e6 / (2 * w * h) for (w, h), ms in self.ms.items()}

    @property
    def growth(self) -> float:
        """Cost per pixel at the largest size over that at the smallest."""
        per_pixel = self.ns_per_pixel
        return per_pixel[SIZES[-1]] / per_pixel[SIZES[0]]


def measure_cost(runs: int = RUNS) -> Cost:
    """Time the sample's first pair at all sizes and the peer in turn, ``runs`` times after one warm-up each.

    Freed memory is kept for the next image, as in a worker.
    """
    keep_freed_memory()
    scene = next(find_ball_scenes(SAMPLES))
    pairs = {size: enlarge(scene, size) for size in SIZES}
    images = [view.image for view in scene.views]
    templates = cut_templates(images[0])
    ms: dict[tuple[int, int], list[float]] = {size: [] for size in SIZES}
    peer: list[float] = []
    for run in range(runs + 1):
        timed = {size: milliseconds(lambda p=pair: find_balls(p)) for size, pair in pairs.items()}  # type: ignore[misc]
        theirs = milliseconds(lambda: match_masked(images, templates))
        if run:
            peer.append(theirs)
            for size, value in timed.items():
                ms[size].append(value)
    return Cost(ms, peer, peak_memory_mb())


def peak_memory_mb() -> float:
    """Return the resident memory, MB, that detection of a pair of the largest size adds in a new process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_peak_memory_mb).result()


def enlarge(scene: BallScene, size: tuple[int, int]) -> BallScene:
    """Return a scene as taken by cameras with more and smaller pixels."""
    left, right = _enlarge(scene.left, size), _enlarge(scene.right, size)
    rig = replace(scene.scene.rig, left=left.camera, right=right.camera)
    return BallScene(replace(scene.scene, rig=rig), left, right)


def _enlarge(view: BallView, size: tuple[int, int]) -> BallView:
    (w, h), (px, py) = view.camera.image_size_px, view.camera.pixel_size_mm
    ratio = np.array(size) / (w, h)
    if (ratio == 1).all():
        return view
    across, down = map(float, ratio)
    camera: Camera = replace(view.camera, image_size_px=size, pixel_size_mm=(px / across, py / down))
    return replace(
        view,
        image=cast(Pixels, cv2.resize(view.image, size, interpolation=cv2.INTER_LINEAR)),
        camera=camera,
        ball_px=(view.ball_px[0] * across, view.ball_px[1] * down),
        centres_px=(view.centres_px + 0.5) * ratio - 0.5,
    )


def _peak_memory_mb() -> float:
    small = next(find_ball_scenes(SAMPLES))
    find_balls(small)  # loads code and templates
    large = enlarge(small, SIZES[-1])
    Path("/proc/self/clear_refs").write_text(_CLEAR_PEAK)
    before = _peak_kb()
    find_balls(large)
    return (_peak_kb() - before) / 1000


def _peak_kb() -> int:
    status = Path("/proc/self/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM")))
