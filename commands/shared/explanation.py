"""Files that explain a measurement: images of each step, and the candidates with what rejected them."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

from commands.shared.files import make_folder, write_bytes, write_text
from commands.shared.methods import Method
from commands.shared.pixels import gray_levels
from contract.explanation import Explanation, ImageCandidates
from contract.features import Feature
from contract.stage import StageResult
from spinewatch.arrays import Pixels
from spinewatch.imaging.frame import Frame
from spinewatch.stage import StageMeasurement, StageRequest

_CHOSEN, _REJECTED, _ALONE = (115, 158, 0), (0, 159, 230), (160, 160, 160)
"""Blue, green and red of features that are balls, of those in rejected triads only, and of the others."""

_SIGMAS = 3.0
_MIN_AXIS_PX = 2
_SCALE = 3
"""Factor by which the image with the candidates is enlarged, so that their ellipses can be told apart."""


def write_explanation(
    folder: Path,
    method: Method,
    frames: tuple[Frame, Frame],
    request: StageRequest,
    measurement: StageMeasurement,
) -> None:
    """Write ``explanation.json``, the candidates of each view as PNG, and the steps of the method.

    Raises ``OutputError`` if the folder cannot be written.
    """
    make_folder(folder)
    explanation = Explanation.of(measurement)
    assert explanation is not None  # noqa: S101 - it was asked for
    document = {
        "explanation": explanation.model_dump(mode="json"),
        "features": StageResult.of(measurement, "").features.model_dump(mode="json"),
        "labels": [triad.label for triad in measurement.triads],
    }
    write_text(folder / "explanation.json", json.dumps(document, indent=1) + "\n")
    features = (measurement.left.features, measurement.right.features)
    for frame, found, shown in zip(frames, features, (explanation.left, explanation.right), strict=True):
        drawn = _drawn(frame, Feature.of(found), shown)
        write_bytes(folder / f"{frame.side}-candidates.png", bytes(cv2.imencode(".png", drawn)[1]))
    method.write_steps(folder, frames, request)


def _drawn(frame: Frame, features: list[Feature], candidates: ImageCandidates) -> Pixels:
    """Return the image (H, W, 3) with the 3-sigma ellipse of each feature, and the names of the balls."""
    size = (frame.size_px[0] * _SCALE, frame.size_px[1] * _SCALE)
    gray = cv2.resize(gray_levels(frame.gray()), size, interpolation=cv2.INTER_NEAREST)
    image = cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR)
    for feature, use in zip(features, candidates.features, strict=True):
        chosen = use.candidate is not None
        colour = _CHOSEN if chosen else _REJECTED if use.reason == "rejected" else _ALONE
        centre = _place(feature)
        axes, angle = _ellipse(feature)
        cv2.ellipse(image, centre, axes, angle, 0, 360, colour, 1, cv2.LINE_AA)
        if chosen:
            beside = (centre[0] + 2 * _SCALE, centre[1] - 2 * _SCALE)
            text = f"{use.candidate} {use.ball}"
            cv2.putText(image, text, beside, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)
    return np.asarray(image, dtype=np.uint8)


def _place(feature: Feature) -> tuple[int, int]:
    return round((feature.x + 0.5) * _SCALE), round((feature.y + 0.5) * _SCALE)


def _ellipse(feature: Feature) -> tuple[tuple[int, int], float]:
    """Return the half axes of the ellipse, px of the drawing, and its angle, degrees."""
    a, b = feature.sd_px
    covariance = np.array([[a * a, feature.correlation * a * b], [feature.correlation * a * b, b * b]])
    values, vectors = np.linalg.eigh(covariance)
    axes = np.maximum(np.rint(_SIGMAS * _SCALE * np.sqrt(np.maximum(values, 0))), _MIN_AXIS_PX)
    angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    return (int(axes[1]), int(axes[0])), angle
