"""``python -m bench.figure [FILE]``: draw the measured triads of the sample into its left image."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.truth import find_scenes, read_frames
from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.pipeline import StageMeasurer
from spinewatch.stage import StageRequest
from spinewatch.triads.labels import LabelledTriad

PROJECT = Path(__file__).parents[1]
RESULT = PROJECT / "docs" / "img" / "result.png"
AXIS_MM = 20.0
MAGNIFY = 3
MARGIN_PX = np.array([55, 40])
BALL = (60, 220, 255)  # colours are blue, green, red
FEATURE = (190, 150, 90)
AXES = ((70, 70, 240), (90, 200, 70), (250, 140, 60))
TEXT = (255, 255, 255)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the figure; return the exit status."""
    names = sys.argv[1:] if arguments is None else arguments
    target = Path(names[0]) if names else RESULT
    scene = next(scene for scene in find_scenes(PROJECT / "samples") if scene.folder.name == "PRE")
    left, right = read_frames(scene.folder)
    measured = StageMeasurer(scene.rig).measure(left, right, StageRequest(scene.labels, scene.spine_axis))
    large = cv2.resize(left.pixels, None, fx=MAGNIFY, fy=MAGNIFY, interpolation=cv2.INTER_LINEAR)
    canvas = cv2.cvtColor(large, cv2.COLOR_GRAY2BGR)
    for centre in measured.left.features.xy_px:
        cv2.drawMarker(canvas, _at(centre), FEATURE, cv2.MARKER_CROSS, 6, 1, cv2.LINE_AA)
    for triad in measured.triads:
        _draw(canvas, scene.rig.left, triad)
    target.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(target), _crop(canvas, measured.triads), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{target}: {target.stat().st_size / 1000:.0f} kB")
    return 0


def _draw(canvas: NDArray[Any], camera: Camera, labelled: LabelledTriad) -> None:
    for ball in labelled.triad.balls.values():
        if ball.left_px is not None:
            cv2.circle(canvas, _at(ball.left_px), 16, BALL, 2, cv2.LINE_AA)
    pose = labelled.triad.pose
    if pose is None:
        return
    origin = camera.project(pose.position_mm)
    for axis, colour in zip(pose.rotation.T, AXES, strict=True):
        tip = camera.project(pose.position_mm + AXIS_MM * axis)
        cv2.arrowedLine(canvas, _at(origin), _at(tip), colour, 2, cv2.LINE_AA, tipLength=0.2)
    u, v = _at(origin)
    name = f"{labelled.label or '?'}  sd {np.linalg.norm(pose.position_sd_mm):.1f} mm"
    for colour, width in (((0, 0, 0), 4), (TEXT, 1)):
        cv2.putText(
            canvas, name, (u - 50, v + 105), cv2.FONT_HERSHEY_SIMPLEX, 0.7, colour, width, cv2.LINE_AA
        )


def _crop(canvas: NDArray[Any], triads: Sequence[LabelledTriad]) -> NDArray[Any]:
    every = [ball for labelled in triads for ball in labelled.triad.balls.values()]
    balls = np.array([ball.left_px for ball in every if ball.left_px is not None])
    u0, v0 = np.maximum(0, balls.min(axis=0) - MARGIN_PX).astype(int) * MAGNIFY
    u1, v1 = (balls.max(axis=0) + MARGIN_PX).astype(int) * MAGNIFY
    return canvas[v0:v1, u0:u1]


def _at(pixel: Float) -> tuple[int, int]:
    u, v = np.rint((pixel + 0.5) * MAGNIFY - 0.5).astype(int)
    return int(u), int(v)


if __name__ == "__main__":
    sys.exit(main())
