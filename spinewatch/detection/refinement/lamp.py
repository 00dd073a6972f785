"""Direction of the cart's lamp, estimated from its reflections in the balls.

The reflection is the most distinct mark on a ball, but it is not at the ball's centre: an error of 0.05 rad in the lamp
direction shifts all centres of a view by 0.1 px. One ball determines the lamp poorly, because its own centre is unknown
too; all balls of both views share the same lamp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig

_CAMERA_TO_IMAGE = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""From camera axes x, y, z to image axes u, v; the rows of an image run down."""


@dataclass(frozen=True, eq=False)
class LampEstimates:
    """Lamp directions estimated from the n balls of one view, each from one ball and the expected direction together.

    A lamp direction is the (u, v) part of the unit vector from the balls to the lamp.

    Attributes
    ----------
    camera
        Camera of the view.
    expected
        Expected direction, shape (2,).
    directions
        Estimated directions, shape (n, 2).
    sd
        Standard deviations of these per axis, shape (n,).
    """

    camera: Camera
    expected: Float
    directions: Float
    sd: Float


def expected_lamp(rig: Rig, camera: Camera, range_mm: float) -> Float:
    """Return the direction of a lamp midway between the cameras.

    Parameters
    ----------
    rig
        The rig.
    camera
        Camera in whose axes the direction is given.
    range_mm
        Distance of the balls along the camera's optical axis, mm.

    Returns
    -------
    Float
        (u, v) part of the unit vector from the balls to the lamp, shape (2,); zero for a lamp at the camera.
    """
    field = camera.centre - range_mm * camera.M[2]
    toward = camera.M @ ((rig.left.centre + rig.right.centre) / 2 - field)
    return np.asarray(_CAMERA_TO_IMAGE @ toward / np.linalg.norm(toward))


def estimate_lamp(views: Sequence[LampEstimates], prior_sd: float) -> tuple[Float, ...]:
    """Return the lamp direction in each view, by least squares over the balls of all views.

    The unknown is one displacement of the lamp from its expected position. Every ball's estimate already contains the
    expectation, which must have weight once, not once per ball. An error of centres towards the lamp appears as
    opposite displacements in views from either side of the lamp, and cancels.

    Parameters
    ----------
    views
        Estimates of each view.
    prior_sd
        Standard deviation of the displacement per axis, on the unit sphere.

    Returns
    -------
    tuple of Float
        (u, v) part of the unit vector from the balls to the lamp in each view, shape (2,).

    Examples
    --------
    >>> camera = Camera((0, 0, 700), (0, 0, 0), 9.0, (0, 0), (0, 0), (0, 0), (568, 416), (0.01, 0.01))
    >>> balls = LampEstimates(camera, np.array([0.2, 0.0]), np.tile([0.25, 0.0], (9, 1)), np.full(9, 0.02))
    >>> estimate_lamp([balls], prior_sd=0.1)[0].round(3)
    array([0.252, 0.   ])
    """
    prior_weight = prior_sd**-2
    towards = np.sum([v.camera.M.T @ _unit_vector(v.expected) for v in views], axis=0)
    across = np.linalg.svd(towards[None])[2][1:]
    normal, right = prior_weight * np.eye(2), np.zeros(2)
    design = [_CAMERA_TO_IMAGE @ v.camera.M @ across.T for v in views]
    for view, a in zip(views, design, strict=True):
        weight = view.sd**-2.0
        normal += (weight - prior_weight).clip(0).sum() * a.T @ a
        right += a.T @ (weight @ (view.directions - view.expected))
    displacement = np.linalg.solve(normal, right)
    return tuple(v.expected + a @ displacement for v, a in zip(views, design, strict=True))


def _unit_vector(lamp: Float) -> Float:
    """Return the unit vector (3,) in camera axes of a lamp direction (2,)."""
    return np.array([lamp[0], -lamp[1], np.sqrt((1 - lamp @ lamp).clip(0))])
