"""The eccentricity of a sphere's outline in perspective."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera


def outline_offsets(camera: Camera, outline_px: Float, width_px: float) -> Float:
    """Return the offsets of the centres of outlines from the images of the balls' centres.

    The rays that touch a ball form a cone of half angle a about the line of sight, which is at the angle t to the
    optical axis. The centre of the ellipse in which the cone meets the image plane is farther from the principal
    point than the image of the cone's axis by the fraction ``tan²a (1 + tan²t) / (1 - tan²t tan²a)``.

    Parameters
    ----------
    camera
        The camera.
    outline_px
        Centres (u, v) of outlines, shape (n, 2), px.
    width_px
        Width of a ball's image near the optical axis, px.

    Returns
    -------
    Float
        Offsets, shape (n, 2), px, to be subtracted from the centres of outlines.

    References
    ----------
    T. Luhmann, Eccentricity in images of circular and spherical targets and its impact on spatial intersection,
    Photogrammetric Record 29, 2014.

    Examples
    --------
    >>> camera = Camera((0, 0, 700), (0, 0, 0), 9.0, (0, 0), (0, 0), (0, 0), (569, 417), (0.01, 0.01))
    >>> outline_offsets(camera, np.array([[284.0, 208.0], [564.0, 208.0]]), 10.0)[:, 0].round(4)
    array([0.    , 0.0095])
    """
    pitch = np.array(camera.pixel_size_mm)
    ideal = camera.undistort(camera.plate(outline_px))
    tan2_t = np.square(ideal / camera.focal_length_mm).sum(axis=1, keepdims=True)
    tan2_a = (width_px * pitch[0] / 2 / camera.focal_length_mm) ** 2
    outwards = ideal * tan2_a * (1 + tan2_t) / (1 - tan2_t * tan2_a)
    return np.asarray(outwards / (pitch * (1, -1)))
