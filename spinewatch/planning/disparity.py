"""The disparity grid of section 7.4: which disparities occur over the field and depth of a rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError


@dataclass(frozen=True, eq=False)
class DisparityGrid:
    """Disparities over a grid of left pixels and planes of depth.

    ``left_px`` (r, c, 2); ``z_mm`` (d,) heights of the planes in object space; ``disparity_px`` (d, r, c, 2),
    right less left pixel of the point in which the left ray meets the plane, NaN where the right camera does not
    see it.
    """

    left_px: Float
    z_mm: Float
    disparity_px: Float

    def bounds_px(self, margin_px: float = 0.0) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return (least, most) of the disparity in u and in v, widened by a margin.

        Within the range limits of a rig these bounds exclude no pair that the epipolar line and the range accept
        (docs/calibration.md).
        """
        values = self.disparity_px.reshape(-1, 2)
        low, high = np.nanmin(values, axis=0) - margin_px, np.nanmax(values, axis=0) + margin_px
        return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))

    def distribution(self) -> tuple[Float, Float]:
        """Return mean and standard deviation (d, 2) of the disparity by plane of depth."""
        by_plane = self.disparity_px.reshape(len(self.z_mm), -1, 2)
        return np.nanmean(by_plane, axis=1), np.nanstd(by_plane, axis=1)


def disparity_grid(
    rig: Rig, z_mm: tuple[float, float], planes: int = 7, cells: tuple[int, int] = (9, 12)
) -> DisparityGrid:
    """Return the disparity grid of a rig between two heights in object space, ``cells`` (rows, columns) per image.

    A height at which both cameras see nothing is left out.

    Raises ``ParameterError`` when no point between the heights is seen by both cameras.
    """
    width, height = rig.left.image_size_px
    u, v = np.meshgrid(np.linspace(0, width - 1, cells[1]), np.linspace(0, height - 1, cells[0]))
    left = np.stack([u, v], axis=-1)
    rays = rig.left.directions(left)
    heights = np.linspace(min(z_mm), max(z_mm), planes)
    with np.errstate(all="ignore"):
        along = (heights[:, None, None] - rig.left.centre[2]) / rays[..., 2]
        points = rig.left.centre + along[..., None] * rays
        right = rig.right.project(np.where(along[..., None] > 0, points, np.nan))
    size = np.array(rig.right.image_size_px)
    seen = np.all((right >= 0) & (right <= size - 1), axis=-1)
    disparity = np.where(seen[..., None], right - left, np.nan)
    if not seen.any():
        raise ParameterError(f"no point between z = {z_mm[0]:g} and {z_mm[1]:g} mm is seen by both cameras")
    kept = seen.any(axis=(1, 2))
    return DisparityGrid(left, heights[kept], disparity[kept])
