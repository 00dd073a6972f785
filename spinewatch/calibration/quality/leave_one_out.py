"""Cross-validation: every control point reconstructed by the rig that follows from the other points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.points import Shot
from spinewatch.calibration.quality.accuracy import ShotAccuracy, common_points, reconstruct
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.bundle import BundleAdjustment
from spinewatch.camera import Rig

LEAVE_ONE_OUT = "leave one out"
"""Name of the accuracy of points left out one at a time."""

_MIN_DOF = 6
_MIN_REDUNDANCY = 1e-3


def leave_one_out(adjustment: BundleAdjustment, shots: Sequence[Shot]) -> ShotAccuracy | None:
    """Return the residuals of every control point, reconstructed by the rig without it.

    The rig without a point follows from the adjusted one in one Gauss-Newton step, exact to second order for one point
    among many. The point is left out of all images and shots.

    Parameters
    ----------
    adjustment
        Adjustment of two cameras, left first.
    shots
        The adjusted shots, without blunders.

    Returns
    -------
    ShotAccuracy or None
        Residuals in all shots, in the board's frame; None when nothing is determined without a point.

    References
    ----------
    R. D. Cook, S. Weisberg, Residuals and Influence in Regression (1982), section 2.2.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints, Sensor
    >>> from spinewatch.calibration.stereo import calibrate_stereo
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig, field, rng = table_3_3_rig(), pegboard_1995(), np.random.default_rng(0)
    >>> images = [
    ...     ImagePoints.build(
    ...         field.ids, field.points_mm, c.project(field.points_mm) + 0.05 * rng.standard_normal((30, 2))
    ...     )
    ...     for c in (rig.left, rig.right)
    ... ]
    >>> sensors = (Sensor.of_camera(rig.left), Sensor.of_camera(rig.right))
    >>> calibration = calibrate_stereo([Shot("1", *images)], sensors)
    >>> len(leave_one_out(calibration.adjustment, calibration.shots).ids)
    30
    """
    if adjustment.block.dof <= _MIN_DOF or not adjustment.is_determined:
        return None
    commons = [common_points(shot) for shot in shots]
    found: dict[tuple[int, str], Float] = {}
    for id_ in dict.fromkeys(id_ for ids, *_ in commons for id_ in ids):
        block = _block_without(adjustment, id_)
        if block is None:
            continue
        at = [(s, common, common[0].index(id_)) for s, common in enumerate(commons) if id_ in common[0]]
        left, right = (np.array([common[side][i] for _, common, i in at]) for side in (2, 3))
        points = reconstruct(Rig(LEAVE_ONE_OUT, *block.cameras), left, right)
        for (s, common, i), point in zip(at, points, strict=True):
            found[s, id_] = block.placements[s].inverse()(point[None])[0] - common[1][i]
    order = [(s, id_) for s, (ids, *_) in enumerate(commons) for id_ in ids if (s, id_) in found]
    if not order:
        return None
    residuals = np.array([found[key] for key in order])
    return ShotAccuracy(LEAVE_ONE_OUT, False, tuple(id_ for _, id_ in order), residuals)


def _block_without(adjustment: BundleAdjustment, id_: str) -> Block | None:
    """Return the block adjusted without a control point, or None when the others do not determine it."""
    observations: list[int] = []
    weighted = []
    residuals = adjustment.weighted_residuals
    for view, image in adjustment.block.images.items():
        if id_ in image.ids:
            i = image.ids.index(id_)
            first = adjustment.block.observation_slices[view].start + 2 * i
            observations += [first, first + 1]
            weighted.append(-residuals[view][i])
    A = adjustment.jacobian[observations]
    redundancy = np.eye(len(A)) - A @ adjustment.cofactor @ A.T
    if np.linalg.eigvalsh(redundancy)[0] < _MIN_REDUNDANCY:
        return None
    change = adjustment.cofactor @ A.T @ np.linalg.solve(redundancy, np.concatenate(weighted))
    return adjustment.block.changed(change)
