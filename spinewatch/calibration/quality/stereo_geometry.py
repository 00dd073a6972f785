"""Geometry of a rig that does not depend on object space: baseline, vergence, range, field of view, depth of field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig

_REACH_MM = np.arange(0.0, 2000.0)
"""Distances from the centre at which the limits of the field of view are searched, mm."""


@dataclass(frozen=True)
class StereoGeometry:
    """Relative orientation of two cameras and their common field at the control field.

    Attributes
    ----------
    baseline_mm, baseline_sd_mm
        Distance of the perspective centres and its standard deviation, mm.
    vergence_deg, vergence_sd_deg
        Angle between the optical axes and its standard deviation, degrees.
    range_mm
        Depth of the control field's centre along each optical axis, left and right, mm.
    field_of_view_mm
        Width and height of the rectangle that both cameras have in view at that range, parallel to the sides of the
        left image and normal to the mean axis, mm.
    depth_of_field_mm
        Nearest and farthest depth at which both cameras have a blur below one pixel, focused at the centre, mm.
    f_number
        F-number of the depth of field.
    control_depth_mm
        Depth of the control points along the mean axis, over which the calibration is verified, mm.
    """

    baseline_mm: float
    baseline_sd_mm: float
    vergence_deg: float
    vergence_sd_deg: float
    range_mm: tuple[float, float]
    field_of_view_mm: tuple[float, float]
    depth_of_field_mm: tuple[float, float]
    f_number: float
    control_depth_mm: float


def stereo_geometry(
    rig: Rig, control_mm: Float, samples: Sequence[Rig] = (), f_number: float = 4.0
) -> StereoGeometry:
    """Return the geometry of a rig at a control field.

    Parameters
    ----------
    rig
        The rig.
    control_mm
        Control points, shape (n, 3), object space, mm.
    samples
        Rigs drawn from the covariance of the calibration, for the standard deviations; NaN without any.
    f_number
        F-number of the lenses.

    Returns
    -------
    StereoGeometry
        The geometry.
    """
    centre = control_mm.mean(axis=0)
    axis = rig.left.M[2] + rig.right.M[2]
    axis = axis / np.linalg.norm(axis)
    depths = (rig.left.depth_mm(centre), rig.right.depth_mm(centre))
    fields = [
        depth_of_field_mm(camera, depth, f_number)
        for camera, depth in zip((rig.left, rig.right), depths, strict=True)
    ]
    return StereoGeometry(
        rig.baseline_mm,
        float(np.std([r.baseline_mm for r in samples])) if samples else float("nan"),
        rig.vergence_deg,
        float(np.std([r.vergence_deg for r in samples])) if samples else float("nan"),
        depths,
        common_field_mm(rig, centre, axis),
        (max(near for near, _ in fields), min(far for _, far in fields)),
        f_number,
        float(np.ptp(control_mm @ axis)),
    )


def depth_of_field_mm(camera: Camera, focus_mm: float, f_number: float) -> tuple[float, float]:
    """Return the depths between which the blur is at most one pixel, for a thin lens.

    Parameters
    ----------
    camera
        The camera; the circle of confusion is one pixel wide.
    focus_mm
        Depth in focus, mm.
    f_number
        Focal length over the diameter of the aperture.

    Returns
    -------
    near, far : float
        Limits, mm; the far limit may be infinite.

    References
    ----------
    Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), section 3.1.3.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> near, far = depth_of_field_mm(table_3_3_rig().left, 700.0, 4.0)
    >>> round(near), round(far)
    (480, 1291)
    """
    f, c = camera.focal_length_mm, camera.pixel_size_mm[0]
    hyperfocal = f * f / (f_number * c) + f
    near = focus_mm * (hyperfocal - f) / (hyperfocal + focus_mm - 2 * f)
    far = focus_mm * (hyperfocal - f) / (hyperfocal - focus_mm) if hyperfocal > focus_mm else float("inf")
    return float(near), float(far)


def common_field_mm(rig: Rig, centre_mm: Float, axis: Float) -> tuple[float, float]:
    """Return the size of the field that both cameras have in view.

    Parameters
    ----------
    rig
        The rig.
    centre_mm
        Point through which the field is measured, shape (3,), mm.
    axis
        Unit normal of the field, shape (3,), object axes.

    Returns
    -------
    width, height : float
        Along the sides of the left image, to 1 mm.
    """
    x = rig.left.M[0] - (rig.left.M[0] @ axis) * axis
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    width = _reach_mm(rig, centre_mm, x) + _reach_mm(rig, centre_mm, -x)
    return width, _reach_mm(rig, centre_mm, y) + _reach_mm(rig, centre_mm, -y)


def _reach_mm(rig: Rig, centre_mm: Float, direction: Float) -> float:
    """Return the distance from a centre along a direction at which a point leaves one of the images."""
    points = centre_mm + _REACH_MM[:, None] * direction
    in_view = np.ones(len(points), dtype=bool)
    for camera in (rig.left, rig.right):
        with np.errstate(all="ignore"):
            pixels = camera.project(points)
            in_view &= np.all((pixels >= 0) & (pixels <= np.array(camera.image_size_px) - 1), axis=1)
    return float(np.argmin(in_view)) if not in_view.all() else float(_REACH_MM[-1])
