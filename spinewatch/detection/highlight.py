"""The reflection of the lamp on a glossy ball: small, sharp and bright on black, the steadiest mark that a ball has.

It does not lie at the centre: a sphere reflects the lamp where its normal halves the angle between lamp and camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.camera import Camera

Float = NDArray[np.float64]


@dataclass(frozen=True)
class HighlightParameters:
    """Parameters of ``find_highlights``.

    ``within``: a highlight is sought within this part of the radius. ``core``: pixels count that rise above
    this fraction of the highlight's height, within ``reach_radii`` of its top. ``least_contrast``: least height,
    as a fraction of the contrast between ball and surroundings; ``least_levels`` the same in gray levels, and
    ``least_noise`` in standard deviations of the levels that surround it.
    """

    within: float = 0.7
    core: float = 0.15
    reach_radii: float = 0.5
    least_contrast: float = 0.12
    least_levels: float = 6.0
    least_noise: float = 8.0


@dataclass(frozen=True, eq=False)
class Highlights:
    """Centroids (n, 2) in px of the brightest spot on each ball, and whether (n,) it is one."""

    xy_px: Float
    present: NDArray[np.bool_]


def find_highlights(
    gray: NDArray[np.floating],
    centres_px: Float,
    contrast: Float,
    ball_px: tuple[float, float],
    parameters: HighlightParameters,
) -> Highlights:
    """Return the highlights of balls (n, 2) of known (width, height) in an image (H, W).

    ``contrast`` (n,) of each ball's surroundings to the ball, in gray levels.
    """
    p = parameters
    if len(centres_px) == 0:
        return Highlights(np.empty((0, 2)), np.empty(0, dtype=bool))
    a, b = (size / 2 for size in ball_px)
    across, down = int(np.ceil(a)), int(np.ceil(b))
    y, x = (grid.ravel() for grid in np.mgrid[-down : down + 1, -across : across + 1])
    origin = np.round(centres_px).astype(int)
    u, v = origin[:, :1] + x, origin[:, 1:] + y
    h, w = gray.shape
    levels = gray[v.clip(0, h - 1), u.clip(0, w - 1)]
    inside = np.hypot((u - centres_px[:, :1]) / a, (v - centres_px[:, 1:]) / b) < p.within
    rank = (0.3 * inside.sum(axis=1)).astype(int)[:, None]
    black = np.take_along_axis(np.sort(np.where(inside, levels, np.inf), axis=1), rank, axis=1)
    rise = np.where(inside, levels - black, 0)
    top = rise.argmax(axis=1)
    height = np.take_along_axis(rise, top[:, None], axis=1)
    reach = np.hypot((x - x[top, None]) / a, (y - y[top, None]) / b) <= p.reach_radii
    weight = np.clip(rise - p.core * height, 0, None) * reach + 1e-9
    xy = np.stack([(weight * u).sum(axis=1), (weight * v).sum(axis=1)], axis=1) / weight.sum(
        axis=1, keepdims=True
    )
    least = np.maximum(
        np.maximum(p.least_levels, p.least_contrast * contrast), p.least_noise * _noise(levels, inside)
    )
    present = height[:, 0] > least
    return Highlights(xy, present)


def _noise(levels: NDArray[np.floating], inside: NDArray[np.bool_]) -> Float:
    """Return the robust standard deviation (n,) of the levels (n, p) inside, which a small highlight hardly changes."""
    half = (0.5 * inside.sum(axis=1)).astype(int)[:, None]

    def median(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.take_along_axis(np.sort(np.where(inside, values, np.inf), axis=1), half, axis=1)

    return np.asarray(1.4826 * median(np.abs(levels - median(levels))))[:, 0]


@dataclass(frozen=True, eq=False)
class Reflectors:
    """Balls as seen by a camera: where they are (n, 3) mm, the camera, and d(pixel)/d(point) (n, 2, 3) there."""

    centre_mm: Float
    camera: Camera
    jacobian: Float
    radius_mm: float

    def take(self, chosen: NDArray[np.bool_]) -> Reflectors:
        """Return the chosen balls."""
        return Reflectors(self.centre_mm[chosen], self.camera, self.jacobian[chosen], self.radius_mm)


def reflectors(camera: Camera, centres_px: Float, range_mm: float, radius_mm: float) -> Reflectors:
    """Return balls at pixels (n, 2) of a camera, supposed at one range (mm) along its axis."""
    direction = camera.directions(centres_px)
    centre = camera.centre - direction * (range_mm / (direction @ camera.M[2]))[:, None]
    return Reflectors(centre, camera, camera.projection_jacobian(centre), radius_mm)


def highlight_offsets(balls: Reflectors, lamp_mm: Float) -> Float:
    """Return the offsets (n, 2) in px of the highlights of a point lamp (3,) from the balls' centres.

    The normal at the highlight is the bisector of the directions to camera and lamp; to first order in the radius.
    """
    to_camera, to_lamp = balls.camera.centre - balls.centre_mm, lamp_mm - balls.centre_mm
    normal = sum(d / np.linalg.norm(d, axis=1, keepdims=True) for d in (to_camera, to_lamp))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray((balls.jacobian @ (balls.radius_mm * normal)[..., None])[..., 0])
