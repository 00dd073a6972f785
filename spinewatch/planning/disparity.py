"""Disparity grid (section 7.2): disparities over the field of view and the depth of a rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError


@dataclass(frozen=True, eq=False)
class DisparityGrid:
    """Disparities over a grid of left pixels and planes of constant height.

    Attributes
    ----------
    left_px
        Left pixels (u, v), shape (r, c, 2), px.
    z_mm
        Heights of the planes, shape (d,), object space, mm.
    disparity_px
        Right minus left pixel of the point in which the left ray meets the plane, shape (d, r, c, 2), px; NaN where
        the point is not inside the right image.
    """

    left_px: Float
    z_mm: Float
    disparity_px: Float

    def bounds_px(self, margin_px: float = 0.0) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the bounds of the disparity.

        Within the range limits of a rig they exclude no pair that the epipolar line and the range accept
        (docs/calibration.md).

        Parameters
        ----------
        margin_px
            Width by which the bounds are extended on either side, px.

        Returns
        -------
        tuple of tuple of float
            (minimum, maximum) in u and in v, px.
        """
        values = self.disparity_px.reshape(-1, 2)
        low, high = np.nanmin(values, axis=0) - margin_px, np.nanmax(values, axis=0) + margin_px
        return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))

    def distribution(self) -> tuple[Float, Float]:
        """Return the distribution of the disparity per plane.

        Returns
        -------
        mean_px : Float
            Mean in u and v, shape (d, 2), px.
        sd_px : Float
            Standard deviation in u and v, shape (d, 2), px.
        """
        by_plane = self.disparity_px.reshape(len(self.z_mm), -1, 2)
        return np.nanmean(by_plane, axis=1), np.nanstd(by_plane, axis=1)


def disparity_grid(
    rig: Rig, z_mm: tuple[float, float], planes: int = 7, cells: tuple[int, int] = (9, 12)
) -> DisparityGrid:
    """Return the disparity grid of a rig between two heights; heights that the images do not share are omitted.

    Parameters
    ----------
    rig
        The cameras.
    z_mm
        The two heights, object space, mm.
    planes
        Number of planes between them, ends included.
    cells
        Rows and columns of left pixels.

    Returns
    -------
    DisparityGrid
        The disparities.

    Raises
    ------
    ParameterError
        If no point between the heights lies inside both images.

    References
    ----------
    Thesis section 7.2, Correspondence, recommendation 3.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> grid = disparity_grid(large_rig(), (60.0, 120.0), planes=3)
    >>> grid.z_mm
    array([ 60.,  90., 120.])
    >>> mean_px, _ = grid.distribution()
    >>> bool(mean_px[0, 0] > mean_px[2, 0])
    True
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
    visible = np.all((right >= 0) & (right <= size - 1), axis=-1)
    if not visible.any():
        raise ParameterError(
            f"no point between z = {z_mm[0]:g} and {z_mm[1]:g} mm lies inside both images; give other heights"
        )
    disparity = np.where(visible[..., None], right - left, np.nan)
    kept = visible.any(axis=(1, 2))
    return DisparityGrid(left, heights[kept], disparity[kept])
