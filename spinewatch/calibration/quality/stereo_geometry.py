"""What does not depend on where object space was put: baseline, vergence, range, field of view and depth of field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig


@dataclass(frozen=True)
class StereoGeometry:
    """Relative orientation of two cameras and what they cover at the control field.

    ``range_mm`` left and right, along each optical axis, to the field's centre; ``field_of_view_mm`` width and
    height of the rectangle, parallel to the left image's sides and square to the mean axis, that both cameras
    see at that range; ``depth_of_field_mm`` nearest and farthest range that both cameras show with blur below
    one pixel at ``f_number``, focused on the field's centre; ``control_depth_mm`` the depth that the control
    points span along the mean axis, for which the calibration was tried.
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
    rig: Rig, control_mm: Float, samples: list[Rig] | None = None, f_number: float = 4.0
) -> StereoGeometry:
    """Return the geometry of a rig at control points (n, 3) in object space.

    Standard deviations come from rigs sampled from the calibration's covariance; without samples they are NaN.
    """
    centre = control_mm.mean(axis=0)
    axis = rig.left.M[2] + rig.right.M[2]
    axis = axis / np.linalg.norm(axis)
    depths = control_mm @ axis
    ranges = (rig.left.depth_mm(centre), rig.right.depth_mm(centre))
    fields = [
        depth_of_field_mm(camera, r, f_number)
        for camera, r in zip((rig.left, rig.right), ranges, strict=True)
    ]
    baselines = [r.baseline_mm for r in samples or []]
    vergences = [r.vergence_deg for r in samples or []]
    return StereoGeometry(
        rig.baseline_mm,
        float(np.std(baselines)) if baselines else float("nan"),
        rig.vergence_deg,
        float(np.std(vergences)) if vergences else float("nan"),
        ranges,
        common_field_mm(rig, centre, axis),
        (max(near for near, _ in fields), min(far for _, far in fields)),
        f_number,
        float(np.ptp(depths)),
    )


def depth_of_field_mm(camera: Camera, range_mm: float, f_number: float) -> tuple[float, float]:
    """Return the nearest and farthest range that appear with a blur of at most one pixel, mm.

    Thin lens focused on ``range_mm``, circle of confusion one pixel wide; the far limit may be infinite.
    """
    f, c = camera.focal_length_mm, camera.pixel_size_mm[0]
    hyperfocal = f * f / (f_number * c) + f
    near = range_mm * (hyperfocal - f) / (hyperfocal + range_mm - 2 * f)
    far = range_mm * (hyperfocal - f) / (hyperfocal - range_mm) if hyperfocal > range_mm else float("inf")
    return float(near), float(far)


def common_field_mm(rig: Rig, centre_mm: Float, axis: Float) -> tuple[float, float]:
    """Return (width, height) in mm, through a centre and square to an axis, of what both cameras see."""
    x = rig.left.M[0] - (rig.left.M[0] @ axis) * axis
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    width = _reach(rig, centre_mm, x) + _reach(rig, centre_mm, -x)
    return width, _reach(rig, centre_mm, y) + _reach(rig, centre_mm, -y)


def _reach(rig: Rig, centre_mm: Float, direction: Float) -> float:
    """Return how far from a centre along a direction points stay in both images, mm, to 1 mm."""
    steps = np.arange(0.0, 2000.0)
    points = centre_mm + steps[:, None] * direction
    seen = np.ones(len(steps), dtype=bool)
    for camera in (rig.left, rig.right):
        with np.errstate(all="ignore"):
            pixels = camera.project(points)
            seen &= np.all((pixels >= 0) & (pixels <= np.array(camera.image_size_px) - 1), axis=1)
    return float(np.argmin(seen)) if not seen.all() else float(steps[-1])
