"""The JSON document of one measured stage (docs/api.md): the CLI prints it, the workers store it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from spinewatch.detection.features import Features
    from spinewatch.flags import Flag
    from spinewatch.matching.rig_check import RigCheck
    from spinewatch.pipeline import StageMeasurement
    from spinewatch.triads.labels import LabelledTriad
    from spinewatch.triads.pose import Ball

_POSE = (
    "position_mm",
    "position_sd_mm",
    "normal",
    "angles_deg",
    "rotation",
    "rotation_sd_deg",
    "covariance",
)


def stage_document(measurement: StageMeasurement) -> dict[str, Any]:
    """Return a measured stage as JSON-ready lists and numbers, at full precision, in mm, degrees and pixels.

    Raises ``ValueError`` when a number is not finite, as JSON has no such number.
    """
    views = {"left": measurement.left, "right": measurement.right}
    return {
        "features": {side: features_document(view.features) for side, view in views.items()},
        "fields": {
            side: [view.field.u0, view.field.v0, view.field.u1, view.field.v1] for side, view in views.items()
        },
        "exposure": {side: str(view.exposure) for side, view in views.items()},
        "triads": [triad_document(triad) for triad in measurement.triads],
        "flags": flags_document(measurement.flags),
        "rig_check": None if measurement.rig_check is None else rig_check_document(measurement.rig_check),
    }


def features_document(features: Features) -> list[dict[str, Any]]:
    """Return one entry a feature: centre and standard deviations in px, score and visible fraction in [0, 1]."""
    centres, scores = _numbers(features.xy_px), _numbers(features.score)
    deviations = _deviations(features.covariance_px2)
    visible = [None] * len(features) if features.visible is None else _numbers(features.visible)
    return [
        {"x": x, "y": y, "score": score, "sd_px": sd, "visible_fraction": fraction}
        for (x, y), score, sd, fraction in zip(centres, scores, deviations, visible, strict=True)
    ]


def triad_document(labelled: LabelledTriad) -> dict[str, Any]:
    """Return a triad's label, pose with its uncertainty, and balls; frames as in ``Pose``.

    Without a pose its entries are null and ``reason`` says why.
    """
    triad = labelled.triad
    return {
        "label": labelled.label,
        "label_reason": labelled.label_reason,
        "model": triad.model,
        "reason": triad.reason,
        **{name: None if triad.pose is None else _numbers(getattr(triad.pose, name)) for name in _POSE},
        "error_mm": _numbers(triad.error_mm),
        "balls": {name: _ball_document(ball) for name, ball in triad.balls.items()},
    }


def flags_document(flags: Sequence[Flag]) -> list[dict[str, str]]:
    """Return flags as objects with ``code`` and ``detail``."""
    return [{"code": flag.code, "detail": flag.detail} for flag in flags]


def rig_check_document(check: RigCheck) -> dict[str, Any]:
    """Return what the balls say about the calibration; the move is the right camera's, in its own axes."""
    return {
        "balls": check.balls,
        "rms_px": _numbers(check.rms_px),
        "chance": _numbers(check.chance),
        "drifted": bool(check.drifted),
        **{
            name: _numbers(getattr(check, name))
            for name in ("turn_deg", "turn_sd_deg", "shift_mm", "shift_sd_mm")
        },
    }


def _ball_document(ball: Ball) -> dict[str, Any]:
    return {
        "position_mm": _numbers(ball.position_mm),
        "sd_mm": _deviations(ball.covariance_mm2),
        "left": None if ball.left_px is None else _numbers(ball.left_px),
        "right": None if ball.right_px is None else _numbers(ball.right_px),
        "parallax_mm": None if ball.parallax_mm is None else _numbers(ball.parallax_mm),
    }


def _deviations(covariance: ArrayLike) -> Any:
    return _numbers(np.sqrt(np.diagonal(np.asarray(covariance), axis1=-2, axis2=-1)))


def _numbers(values: ArrayLike) -> Any:
    array = np.asarray(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise ValueError("a result is not finite")
    return array.tolist()
