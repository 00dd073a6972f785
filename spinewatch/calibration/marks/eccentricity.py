"""Perspective eccentricity: the image of a disc is not centred on the image of the disc's centre."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

_CORNERS = 48


def eccentricity_px(camera: Camera, placement: RigidTransform, control_mm: Float, spread_px2: Float) -> Float:
    """Return by how much the centroids of flat marks lie off the images (n, 2) of their centres, px.

    Marks lie parallel to the board's XY plane at ``control_mm`` (n, 3); their size follows from the spread (n,)
    seen in the image. To second order a mark of any shape with equal variances is moved like the disc that
    has the same variances.
    """
    centres = placement(control_mm)
    in_plane = placement.rotation[:, :2]
    J = camera.projection_jacobian(centres) @ in_plane
    scale = np.abs(np.linalg.det(J))
    radius = np.sqrt(4 * spread_px2 / scale)
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
