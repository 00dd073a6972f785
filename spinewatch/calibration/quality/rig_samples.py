"""Rigs drawn from the covariance of a calibration."""

from __future__ import annotations

import numpy as np

from spinewatch.calibration.solve.bundle import BundleAdjustment
from spinewatch.camera import Rig


def sample_rigs(
    adjustment: BundleAdjustment, n_samples: int, rng: np.random.Generator, name: str = "sample"
) -> list[Rig]:
    """Return rigs that agree with an adjustment within its uncertainty.

    Parameters
    ----------
    adjustment
        Adjustment of two cameras, left first, with redundancy.
    n_samples
        Number of rigs.
    rng
        Source of the samples.
    name
        Name of the rigs.

    Returns
    -------
    list of Rig
        Rigs of the normal distribution whose mean is the adjusted rig.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints, Sensor, Shot
    >>> from spinewatch.calibration.stereo import calibrate_stereo
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig, field = table_3_3_rig(), pegboard_1995()
    >>> images = [
    ...     ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    ...     for camera in (rig.left, rig.right)
    ... ]
    >>> sensors = (Sensor.of_camera(rig.left), Sensor.of_camera(rig.right))
    >>> adjustment = calibrate_stereo([Shot("1", *images)], sensors).adjustment
    >>> [round(r.baseline_mm, 3) for r in sample_rigs(adjustment, 2, np.random.default_rng(0))]
    [421.931, 421.931]
    """
    n_cameras = sum(map(len, adjustment.block.free))
    S = adjustment.covariance[:n_cameras, :n_cameras]
    scale = np.sqrt(np.diag(S))
    w, V = np.linalg.eigh(S / np.outer(scale, scale))
    draws = rng.standard_normal((n_samples, n_cameras)) * np.sqrt(np.maximum(w, 0)) @ V.T * scale
    change = np.zeros(adjustment.block.n_unknowns)
    rigs = []
    for draw in draws:
        change[:n_cameras] = draw
        left, right = adjustment.block.changed(change).cameras
        rigs.append(Rig(name, left, right))
    return rigs
