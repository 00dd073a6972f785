"""Reconstruction of control points by a rig: SIM3D of the thesis, Table 3.4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.points import Shot
from spinewatch.camera import Rig
from spinewatch.geometry.transforms import fit_rigid
from spinewatch.geometry.triangulation import triangulate

TABLE_3_4_SD_MM = (0.34, 0.35, 0.66)
"""Standard deviations in X, Y and Z of the reconstructed control points of the thesis, Table 3.4, mm."""

_MIN_RIGID_POINTS = 3


@dataclass(frozen=True, eq=False)
class ShotAccuracy:
    """Residuals of the reconstructed control points of one shot.

    Attributes
    ----------
    name
        Name of the shot.
    used
        Whether the shot took part in the adjustment; its residuals are then about 1.5 times too small.
    ids
        Names of the n points.
    residuals_mm
        Reconstructed less control points, shape (n, 3), mm.
    """

    name: str
    used: bool
    ids: tuple[str, ...]
    residuals_mm: Float

    @property
    def mean_mm(self) -> Float:
        """Mean residual per axis, shape (3,), mm; NaN without points."""
        return self.residuals_mm.mean(axis=0) if len(self.ids) else np.full(3, np.nan)

    @property
    def sd_mm(self) -> Float:
        """Standard deviation of the residuals per axis, shape (3,), mm; NaN below two points."""
        return self.residuals_mm.std(axis=0, ddof=1) if len(self.ids) > 1 else np.full(3, np.nan)


def reconstruct(rig: Rig, left_px: Float, right_px: Float) -> Float:
    """Return the object points of pairs of image points.

    Parameters
    ----------
    rig
        The rig.
    left_px, right_px
        Corresponding image points, shape (n, 2), px.

    Returns
    -------
    Float
        Points, shape (n, 3), object space, mm.

    Raises
    ------
    ConvergenceError
        If the rays determine no point.

    References
    ----------
    Thesis eq. 5.15.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig, point = table_3_3_rig(), np.array([[400.0, 400.0, 50.0]])
    >>> reconstruct(rig, rig.left.project(point), rig.right.project(point)).round(6)
    array([[400., 400.,  50.]])
    """
    rays = [camera.rays(pixels, np.eye(2)) for camera, pixels in ((rig.left, left_px), (rig.right, right_px))]
    try:
        return triangulate(rays).position_mm
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "the rays of left and right points do not meet; check the coordinates, which are in mm and px"
        ) from error


def common_points(shot: Shot) -> tuple[tuple[str, ...], Float, Float, Float]:
    """Return the points measured in both images of a shot.

    Parameters
    ----------
    shot
        The shot.

    Returns
    -------
    ids : tuple of str
        Names of the n points.
    control_mm : Float
        Object coordinates, shape (n, 3), frame of the board, mm.
    left_px, right_px : Float
        Image coordinates, shape (n, 2), px.
    """
    in_right = {id_: j for j, id_ in enumerate(shot.right.ids)}
    ids = tuple(id_ for id_ in shot.left.ids if id_ in in_right)
    i = np.array([k for k, id_ in enumerate(shot.left.ids) if id_ in in_right], dtype=np.intp)
    j = np.array([in_right[id_] for id_ in ids], dtype=np.intp)
    return ids, shot.left.control_mm[i], shot.left.pixels[i], shot.right.pixels[j]


def shot_accuracy(rig: Rig, shot: Shot, *, used: bool, defines_object_space: bool) -> ShotAccuracy:
    """Return the residuals of the control points of a shot reconstructed by a rig.

    Parameters
    ----------
    rig
        The rig.
    shot
        The shot.
    used
        Whether it took part in the adjustment.
    defines_object_space
        Whether the board's frame is object space; otherwise its rigid motion is removed first.

    Returns
    -------
    ShotAccuracy
        Residuals of the common points; none if there are fewer than three.

    References
    ----------
    Thesis section 3.4 and Table 3.4.
    """
    ids, control, left, right = common_points(shot)
    if len(ids) < _MIN_RIGID_POINTS:
        return ShotAccuracy(shot.name, used, (), np.empty((0, 3)))
    points = reconstruct(rig, left, right)
    if not defines_object_space:
        points = fit_rigid(points, control)(points)
    return ShotAccuracy(shot.name, used, ids, points - control)


def calibration_accuracy(
    rig: Rig, adjusted: Sequence[Shot], held_out: Sequence[Shot] = ()
) -> tuple[ShotAccuracy, ...]:
    """Return the accuracy of a rig in all shots.

    Parameters
    ----------
    rig
        The rig.
    adjusted
        Shots that took part in its adjustment, without blunders; the first defines object space.
    held_out
        Shots that did not.

    Returns
    -------
    tuple of ShotAccuracy
        Adjusted shots, then those held out.
    """
    used = [
        shot_accuracy(rig, shot, used=True, defines_object_space=i == 0) for i, shot in enumerate(adjusted)
    ]
    fresh = [shot_accuracy(rig, shot, used=False, defines_object_space=False) for shot in held_out]
    return (*used, *fresh)
