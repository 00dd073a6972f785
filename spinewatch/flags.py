"""Flags: named doubts about a result. Nothing is dropped or doubted without one.

`FLAGS` lists every flag with its meaning and what to do; docs/flags.md is generated from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class FlagKind:
    """What a flag means.

    Attributes
    ----------
    code
        Stable name, for machines.
    subject
        What the flag is about: image, stage, calibration.
    meaning
        What was found.
    action
        What to do about it.
    false_alarms
        How often sound input raises the flag where it has a threshold: measured rate, on what, and the command that
        prints it. Empty for a flag without a threshold.
    """

    code: str
    subject: str
    meaning: str
    action: str
    false_alarms: str = ""


@dataclass(frozen=True)
class Flag:
    """A flag raised on a result.

    Attributes
    ----------
    code
        Code of a kind in `FLAGS`.
    detail
        Sentence with the numbers that raised it, for people.
    """

    code: str
    detail: str

    def __post_init__(self) -> None:
        if self.code not in FLAGS:
            raise ValueError(f"{self.code!r} is no flag; add its kind to spinewatch/flags.py")


_KINDS = (
    FlagKind(
        "blank-image",
        "image",
        "The gray levels of an image span almost nothing; no feature can be detected.",
        "Look for a closed aperture, a lens cap or a loose cable.",
    ),
    FlagKind(
        "image-dark",
        "image",
        "The image is darker than it should be even after two gamma corrections; features may be missed.",
        "Open the aperture or brighten the lamp.",
    ),
    FlagKind(
        "image-saturated",
        "image",
        "A large part of the image is at full scale; balls in it cannot be detected.",
        "Close the aperture or dim the lamp.",
    ),
    FlagKind(
        "no-features",
        "image",
        "Nothing in the image resembles a ball.",
        "Check that the cameras are aimed at the field and that the calibration belongs to this rig.",
    ),
    FlagKind(
        "triad-count-low",
        "stage",
        "Fewer triads were found than were placed; those that were found are given.",
        "Look for a hidden ball, clear the view and take the stage again.",
    ),
    FlagKind(
        "ball-occluded",
        "stage",
        "A ball is hidden in one view; the pose of its triad follows from the other ball images, with larger"
        " deviations.",
        "Clear the view and take the stage again where the deviations matter.",
    ),
    FlagKind(
        "triad-incomplete",
        "stage",
        "The visible balls of a triad do not determine its pose; the triad is given without one.",
        "Clear the view and take the stage again.",
    ),
    FlagKind(
        "labels-uncertain",
        "stage",
        "Triads are missing and the gaps between the others do not determine which; all labels are null.",
        "Take the stage again with every triad in view.",
    ),
    FlagKind(
        "calibration-drift",
        "stage",
        "The ball images no longer satisfy the epipolar geometry of the calibration: a camera has moved. A rotation"
        " about the vertical of the image and a shift along the baseline or towards the field are not detected.",
        "Check the cameras and calibrate again.",
    ),
    FlagKind(
        "calibration-old",
        "stage",
        "The calibration was older than `SPINEWATCH_CALIBRATION_MAX_AGE_DAYS` when the stage was taken. Cameras are"
        " refocused and the cart is moved between operations, so each needs its own calibration; errors may exceed the"
        " stated deviations.",
        "Calibrate before the operation. If the rig was not touched since, look at the drift of its stages"
        " (`GET /v1/calibrations/{id}/checks`).",
    ),
    FlagKind(
        "rig-refined",
        "stage",
        "The relative orientation of the cameras was corrected from the ball images before measuring.",
        "Calibrate again when possible.",
    ),
    FlagKind(
        "control-point-removed",
        "calibration",
        "An image point of the control field contradicts the others and was removed; the detail names side, shot, point"
        " and residual.",
        "Look at the point in the image. Measure its coordinates again if the same point is removed in several shots.",
    ),
    FlagKind(
        "parameters-held",
        "calibration",
        "One of f, x0, y0 and K1 was held at zero or at the given value: the points do not determine it, or it was not"
        " to be adjusted.",
        "Nothing if it was intended. Otherwise show more points, nearer the corners and of more different heights, or"
        " another tilted shot.",
    ),
    FlagKind(
        "no-redundancy",
        "calibration",
        "There are as many unknowns as observations: residuals are zero and no deviation can be stated.",
        "Show more points or give more shots.",
    ),
    FlagKind(
        "adjustment-unfinished",
        "calibration",
        "The adjustment was stopped while it still improved; the rig and its deviations are not those of least"
        " squares.",
        "Show more points or free fewer parameters.",
    ),
)

FLAGS: Mapping[str, FlagKind] = {kind.code: kind for kind in _KINDS}
"""Every kind of flag by its code."""
