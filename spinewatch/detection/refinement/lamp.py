"""Where the cart's lamp hangs: midway between the cameras, or a little off, as its reflections in the balls say.

The reflection is the sharpest mark on a ball, but not at its centre: who takes the lamp to be 0.05 rad from where it
is places every centre of a view 0.1 px off. What one ball says is vague, since its centre is not known either. All
balls of both views share the lamp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig

_TO_PICTURE = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""From x, y, z of a camera to u, v: rows of a picture run down."""


@dataclass(frozen=True, eq=False)
class Reflections:
    """What n balls of a camera's view say of the lamp, as u and v components of the unit vector to it.

    ``expected`` (2,) where it should hang; ``seen`` (n, 2) with standard deviation ``sd`` (n,) an axis, each by one
    ball and what was expected together.
    """

    camera: Camera
    expected: Float
    seen: Float
    sd: Float


def expected_lamp(rig: Rig, camera: Camera, range_mm: float) -> Float:
    """Return where a lamp between the cameras hangs in a camera's picture.

    The components u and v (2,) of the unit vector to it, seen from the point of the camera's axis at a range;
    zero would be a lamp at the camera itself.
    """
    field = camera.centre - range_mm * camera.M[2]
    toward = camera.M @ ((rig.left.centre + rig.right.centre) / 2 - field)
    return np.asarray(_TO_PICTURE @ toward / np.linalg.norm(toward))


def measured_lamp(views: Sequence[Reflections], prior_sd: float) -> tuple[Float, ...]:
    """Return where the lamp hangs in each view (2,), by the reflections in all of them.

    Least squares for its displacement from where it should hang, which is ``prior_sd`` an axis and the same for all.
    Every ball's word contains the expectation, which must count once, not once a ball. An error of centres towards the
    lamp shows as opposite displacements in views from either side of it, and cancels.
    """
    once = prior_sd**-2
    towards = np.sum([v.camera.M.T @ _unit(v.expected) for v in views], axis=0)
    across = np.linalg.svd(towards[None])[2][1:]
    normal, right = once * np.eye(2), np.zeros(2)
    design = [_TO_PICTURE @ v.camera.M @ across.T for v in views]
    for view, a in zip(views, design, strict=True):
        weight = view.sd**-2.0
        normal += (weight - once).clip(0).sum() * a.T @ a
        right += a.T @ (weight @ (view.seen - view.expected))
    displaced = np.linalg.solve(normal, right)
    return tuple(v.expected + a @ displaced for v, a in zip(views, design, strict=True))


def _unit(lamp: Float) -> Float:
    return np.array([lamp[0], -lamp[1], np.sqrt((1 - lamp @ lamp).clip(0))])
