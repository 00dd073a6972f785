"""What contradicts the fit of a rig to its shots: residuals in the images and on the board, doubt of the baseline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust, rms
from spinewatch.camera import Rig

_POSITION = ("X0", "Y0", "Z0")


@dataclass(frozen=True)
class FitDoubts:
    """Reasons against a fit.

    Attributes
    ----------
    refused
        Reasons for which it is no calibration.
    flagged
        Reasons for which it is a poor one.
    """

    refused: tuple[str, ...]
    flagged: tuple[str, ...]


@dataclass(frozen=True)
class FitLimits:
    """Limits that a fit is compared with.

    Attributes
    ----------
    rms_px
        Image RMS above which it is flagged, px.
    baseline_sd_mm
        Standard deviation of the baseline above which it is flagged, and refused, mm.
    reconstruction_mm
        RMS of the reconstructed control points per coordinate above which it is flagged, and refused, mm.
    """

    rms_px: float
    baseline_sd_mm: tuple[float, float]
    reconstruction_mm: tuple[float, float]


def fit_limits(rig: Rig, shots: Sequence[Shot], parameters: CalibrationLimits) -> FitLimits:
    """Return the limits of the fit of a rig to its shots.

    Parameters
    ----------
    rig
        The rig.
    shots
        Its shots without blunders.
    parameters
        Limits as fractions of baseline and field.

    Returns
    -------
    FitLimits
        Limits, px and mm.
    """
    baseline = parameters.baseline_sd * rig.baseline_mm
    residual = parameters.residual_of_field * _diagonal_mm(shots)
    doubt = parameters.doubtful
    return FitLimits(parameters.rms_px, (doubt * baseline, baseline), (doubt * residual, residual))


def fit_doubts(
    rig: Rig, shots: Sequence[Shot], adjustment: BundleAdjustment, parameters: CalibrationLimits
) -> FitDoubts:
    """Return what contradicts an adjusted rig: image residuals, deviation of the baseline, residuals on the board.

    Parameters
    ----------
    rig
        The rig.
    shots
        Its shots without blunders.
    adjustment
        Adjustment of both cameras, left first.
    parameters
        Limits.

    Returns
    -------
    FitDoubts
        Reasons with their numbers. Without redundancy there are none: nothing can be compared.
    """
    if adjustment.block.dof <= 0:
        return FitDoubts((), ())
    if not adjustment.is_determined:
        return FitDoubts(("the points leave the cameras undetermined",), ())
    refused: list[str] = []
    flagged: list[str] = []
    limits = fit_limits(rig, shots, parameters)
    rms_px = adjustment.rms_px
    if rms_px > limits.rms_px:
        alone = _single_camera_rms_px(adjustment)
        text = f"image RMS {rms_px:.2f} px, each camera alone {alone:.2f} px"
        (refused if rms_px > parameters.rms_of_single * alone else flagged).append(text)
    sd, (doubtful, impossible) = baseline_sd_mm(adjustment), limits.baseline_sd_mm
    if not sd <= doubtful:
        text = f"baseline {rig.baseline_mm:.4g} +- {sd:.2g} mm"
        (flagged if sd <= impossible else refused).append(text)
    residual, (doubtful, impossible) = _residual_mm(rig, shots, adjustment), limits.reconstruction_mm
    if residual > doubtful:
        text = (
            f"control points reconstructed with an RMS error of {residual:.2g} mm in a field of"
            f" {_diagonal_mm(shots):.0f} mm"
        )
        (flagged if residual <= impossible else refused).append(text)
    return FitDoubts(tuple(refused), tuple(flagged))


def baseline_sd_mm(adjustment: BundleAdjustment) -> float:
    """Return the standard deviation of the distance of two cameras, propagated from their covariance.

    Parameters
    ----------
    adjustment
        Adjustment of both cameras.

    Returns
    -------
    float
        Standard deviation, mm.
    """
    left, right = adjustment.block.cameras
    direction = (right.centre - left.centre) / np.linalg.norm(right.centre - left.centre)
    gradient = np.zeros(len(adjustment.names))
    for c, sign in ((0, -1.0), (1, 1.0)):
        for name, component in zip(_POSITION, direction, strict=True):
            if f"{c}:{name}" in adjustment.names:
                gradient[adjustment.names.index(f"{c}:{name}")] = sign * component
    return float(np.sqrt(gradient @ adjustment.covariance @ gradient))


def _single_camera_rms_px(adjustment: BundleAdjustment) -> float:
    """Return the greater RMS of the two cameras, each adjusted with its own placements of the board."""
    block = adjustment.block
    values = []
    for c in range(len(block.cameras)):
        shots = sorted(s for camera, s in block.images if camera == c)
        alone = replace(
            block,
            cameras=(block.cameras[c],),
            placements=tuple(block.placements[s] for s in shots),
            images={(0, i): block.images[c, s] for i, s in enumerate(shots)},
            free=(block.free[c],),
        )
        values.append(adjust(alone).rms_px)
    return max(values)


def _residual_mm(rig: Rig, shots: Sequence[Shot], adjustment: BundleAdjustment) -> float:
    """Return the RMS of the reconstructed control points of the shots, per coordinate."""
    images = adjustment.block.images
    residuals = [
        shot_accuracy(rig, shot, used=True, defines_object_space=s == 0).residuals_mm
        for s, shot in enumerate(shots)
        if (0, s) in images and (1, s) in images
    ]
    values = np.concatenate([r.ravel() for r in residuals]) if residuals else np.zeros(1)
    return rms(values[np.isfinite(values)])


def _diagonal_mm(shots: Sequence[Shot]) -> float:
    points: Float = np.concatenate([image.control_mm for shot in shots for image in shot.images])
    return float(np.linalg.norm(np.ptp(points, axis=0)))
