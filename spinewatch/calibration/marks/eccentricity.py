"""Perspective eccentricity: the centroid of the image of a disc is not the image of its centre."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

_CORNERS = 48


def eccentricity_px(
    camera: Camera, placement: RigidTransform, control_mm: Float, variance_px2: Float
) -> Float:
    """Return the offsets of the centroids of flat marks from the images of their centres.

    The marks are parallel to the XY plane of the board. To second order a mark of any shape with equal principal
    variances is displaced like the disc of the same variances.

    Parameters
    ----------
    camera
        The camera.
    placement
        Motion from the board's frame to object space.
    control_mm
        Centres of the marks, shape (n, 3), frame of the board, mm.
    variance_px2
        Mean principal variance of the image of each mark, shape (n,), px^2; it gives the size.

    Returns
    -------
    Float
        Centroid less image of the centre, shape (n, 2), px.

    References
    ----------
    Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), section 3.6.1.2. T. Luhmann, "Eccentricity in
    images of circular and spherical targets", Photogrammetric Record 29 (2014) 417.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> offset = eccentricity_px(
    ...     table_3_3_rig().left, RigidTransform.identity(), np.array([[400.0, 400.0, 0.0]]), np.array([15.0])
    ... )
    >>> bool(0.005 < np.hypot(*offset[0]) < 0.05)
    True
    """
    centres = placement(control_mm)
    in_plane = placement.rotation[:, :2]
    J = camera.projection_jacobian(centres) @ in_plane
    scale = np.abs(np.linalg.det(J))
    radius = np.sqrt(4 * variance_px2 / scale)
    angle = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = centres[:, None] + radius[:, None, None] * (rim @ in_plane.T)
    return _polygon_centroid(camera.project(points)) - camera.project(centres)


def _polygon_centroid(corners: Float) -> Float:
    """Return the centroids (n, 2) of polygons (n, k, 2)."""
    origin = corners.mean(axis=1, keepdims=True)
    a = corners - origin
    b = np.roll(a, -1, axis=1)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    centroid = ((a + b) * cross[..., None]).sum(axis=1) / (3 * cross.sum(axis=1, keepdims=True))
    return np.asarray(origin[:, 0] + centroid)
