"""The third ball of a triad of which two are known: its circle, and the features near the image of the circle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.geometry.projection import PinholeStack
from spinewatch.geometry.rays import Rays
from spinewatch.markers import TriadModel

_MIN_NORM = 1e-9
"""Vectors shorter than this have no direction."""


@dataclass(frozen=True, eq=False)
class Circles:
    """c circles of the same radius.

    Attributes
    ----------
    centre_mm
        Centres, shape (c, 3), object space, mm.
    axis
        Unit normals of their planes, shape (c, 3).
    first
        Unit vectors from the centres to the first points, shape (c, 3).
    radius_mm
        Radius, mm.
    n_points
        Number of points that represent a circle.
    """

    centre_mm: Float
    axis: Float
    first: Float
    radius_mm: float
    n_points: int

    @cached_property
    def points_mm(self) -> Float:
        """Evenly spaced points of the circles, shape (c, 3, n), mm."""
        angle = np.linspace(0, 2 * np.pi, self.n_points, endpoint=False)
        second = np.cross(self.axis, self.first)
        weights = np.stack(
            [np.ones(self.n_points), self.radius_mm * np.cos(angle), self.radius_mm * np.sin(angle)]
        )
        return np.asarray(np.stack([self.centre_mm, self.first, second], axis=-1) @ weights)

    def along_sight(self, index: Int, point: Int, sight: Float, min_depth: float) -> tuple[Float, Float]:
        """Return the two points of circles on lines of sight that pass near a point of theirs.

        Where the line of sight touches the circle, they are moved apart to a fraction of the radius.

        Parameters
        ----------
        index
            Indices of the circles, shape (k,).
        point
            Indices of the points of the circles, shape (k,).
        sight
            Vectors along the lines of sight, shape (k, 3), object space.
        min_depth
            Smallest distance of the two points from the middle between them, as a fraction of the radius.

        Returns
        -------
        near, far : Float
            Points, shape (k, 3), object space, mm; the one against the direction of the vector first.
        """
        radial = self.points_mm[index, :, point] - self.centre_mm[index]
        axis = self.axis[index]
        line = sight - (sight * axis).sum(axis=1, keepdims=True) * axis
        line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), _MIN_NORM)
        depth = (radial * line).sum(axis=1, keepdims=True)
        across = radial - depth * line
        depth = np.maximum(np.abs(depth), min_depth * self.radius_mm)
        near, far = (self._on_circle(index, across + sign * depth * line) for sign in (-1, 1))
        return near, far

    def _on_circle(self, index: Int, radial: Float) -> Float:
        """Return the points (k, 3) of circles (k,) in the direction of vectors (k, 3) from their centres."""
        radial *= self.radius_mm / np.linalg.norm(radial, axis=1, keepdims=True)
        return np.asarray(self.centre_mm[index] + radial)


@dataclass(frozen=True, eq=False)
class NearFeatures:
    """k pairs of a circle and a feature near its image.

    Attributes
    ----------
    circle
        Indices of the circles, shape (k,).
    feature
        Indices of the features, shape (k,).
    point
        Indices of the points of the circles that are imaged nearest to the features, shape (k,).
    distance_mm
        Distances of the features from the images of these points, shape (k,), undistorted image plane, mm.
    """

    circle: Int
    feature: Int
    point: Int
    distance_mm: Float


def third_ball_circles(
    first_mm: Float, second_mm: Float, model: TriadModel, balls: tuple[int, int], n_points: int
) -> Circles:
    """Return the circles on which the third ball of a triad must lie.

    Parameters
    ----------
    first_mm, second_mm
        Positions of the two known balls, shape (c, 3), object space, mm.
    model
        Marker of three balls.
    balls
        Indices of the known ones.
    n_points
        Number of points that represent a circle.

    Returns
    -------
    Circles
        Circles about the lines through the known balls; their first points are as far towards Z as possible.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> A, B, C = FLAT_10_14_18.coordinates_mm
    >>> circles = third_ball_circles(A[None], B[None], FLAT_10_14_18, (0, 1), 360)
    >>> bool(np.linalg.norm(circles.points_mm[0].T - C, axis=1).min() < 0.1)
    True
    """
    a, b = balls
    A, B, C = (model.coordinates_mm[k] for k in (a, b, 3 - a - b))
    span = float(np.linalg.norm(B - A))
    along = float((C - A) @ (B - A)) / span
    radius = float(np.sqrt(((C - A) ** 2).sum() - along**2))
    u = (second_mm - first_mm) / np.linalg.norm(second_mm - first_mm, axis=1, keepdims=True)
    centre = (first_mm + second_mm) / 2 + (along - span / 2) * u
    return Circles(centre, u, frames_near_z(u)[:, :, 2], radius, n_points)


def features_near_circles(circles: Circles, rays: Rays, free: Int, max_distance_mrad: float) -> NearFeatures:
    """Return the features of an image that are near the image of a circle.

    Parameters
    ----------
    circles
        The circles.
    rays
        Rays of the features of the image.
    free
        Indices of the features that are considered, shape (f,).
    max_distance_mrad
        Largest distance from the image of a circle, mrad.

    Returns
    -------
    NearFeatures
        Each circle with each feature near its image, once.
    """
    if not len(circles.centre_mm) or not len(free):
        none = np.empty(0, dtype=np.intp)
        return NearFeatures(none, none, none, np.empty(0))
    cameras = PinholeStack.of([rays.pinhole])
    images = cameras.ideal(np.swapaxes(circles.points_mm, 0, 1).reshape(3, -1))[0]
    margin = rays.pinhole.focal_length_mm * max_distance_mrad / 1000
    image, k, distance = _neighbours(images, np.ascontiguousarray(rays.ideal_mm[free].T), margin)
    circle, point = np.divmod(image, circles.n_points)
    pair = circle * len(free) + k
    order = np.lexsort((distance, pair))
    nearest = order[np.diff(pair[order], prepend=-1) > 0]
    return NearFeatures(circle[nearest], free[k[nearest]], point[nearest], distance[nearest])


def frames_near_z(x: Float) -> Float:
    """Return frames of a given x axis whose z axis is as near to Z as possible.

    Parameters
    ----------
    x
        Unit vectors, shape (n, 3).

    Returns
    -------
    Float
        Rotations from the frames to the axes of the vectors, shape (n, 3, 3).

    Examples
    --------
    >>> frames_near_z(np.array([[0.0, 1.0, 0.0]]))[0, :, 2]
    array([0., 0., 1.])
    """
    z = np.array([0.0, 0.0, 1.0]) - x[:, 2:] * x
    z /= np.maximum(np.linalg.norm(z, axis=1, keepdims=True), _MIN_NORM)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _neighbours(points: Float, others: Float, radius: float) -> tuple[Int, Int, Float]:
    """Return the pairs (p,), (p,) of points (2, n) and others (2, m) within a radius, with their distances (p,).

    The plane is divided into cells as wide as the radius: near others lie in the nine cells about a point.
    """
    low = others.min(axis=1, keepdims=True) - 2 * radius
    high = others.max(axis=1, keepdims=True) + 2 * radius
    near = np.flatnonzero(np.logical_and.reduce((points > low) & (points < high)))
    (row, column), (other_row, other_column) = (
        ((xy - low) / radius).astype(np.intp) for xy in (points[:, near], others)
    )
    width = int(column.max(initial=0)) + int(other_column.max()) + 2
    around = np.array([i * width + j for i in (-1, 0, 1) for j in (-1, 0, 1)])
    cells = (other_row * width + other_column + around[:, None]).ravel()
    order = np.argsort(cells, kind="stable")
    counts = np.bincount(cells, minlength=int(row.max(initial=0) + 1) * width)
    cell = row * width + column
    count, first = counts[cell], (np.cumsum(counts) - counts)[cell]
    point = np.repeat(near, count)
    within = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
    other = order[np.repeat(first, count) + within] % others.shape[1]
    apart = points[:, point] - others[:, other]
    distance = np.sqrt((apart * apart).sum(axis=0))
    kept = np.flatnonzero(distance <= radius)
    return point[kept], other[kept], distance[kept]
