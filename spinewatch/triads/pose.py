"""Position and full orientation of a triad from its three balls; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float


@dataclass(frozen=True, eq=False)
class Ball:
    """One ball of a marker.

    ``position_mm`` (3,) and ``covariance_mm2`` (3, 3) in object space: of its two rays, or of the marker's
    pose when a view does not show it. Its images ``left_px`` and ``right_px`` (2,), None where hidden, and
    the distance ``parallax_mm`` by which its two rays miss each other.
    """

    position_mm: Float
    covariance_mm2: Float
    left_px: Float | None
    right_px: Float | None
    parallax_mm: float | None

    @property
    def hidden_in(self) -> tuple[str, ...]:
        """The views that do not show it."""
        sides = (("left", self.left_px), ("right", self.right_px))
        return tuple(side for side, image in sides if image is None)


@dataclass(frozen=True, eq=False)
class Pose:
    """A triad in object space.

    ``position_mm`` (3,) of P; ``rotation`` (3, 3), whose columns are the triad's axes (x = MX to XX, z =
    normal); ``covariance`` (6, 6) of the position in mm and of a small rotation vector about the OBJECT axes
    in degrees, with ``R_true = Exp(dtheta) R``.
    """

    position_mm: Float
    rotation: Float
    covariance: Float

    @property
    def normal(self) -> Float:
        """Unit normal (3,), the thesis's orientation of a triad (fig. 5.7)."""
        return self.rotation[:, 2]

    @property
    def angles_deg(self) -> Float:
        """Angles (alpha, beta, gamma) of the normal with the object axes X, Y, Z, degrees."""
        return np.degrees(np.arccos(np.clip(self.normal, -1, 1)))

    @property
    def position_sd_mm(self) -> Float:
        """Standard deviations (3,) of the position along the object axes, mm."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def rotation_sd_deg(self) -> Float:
        """Standard deviations (3,) of the rotation about the triad's own x, y and z axes, degrees."""
        return np.sqrt(np.diag(self.rotation.T @ self.covariance[3:, 3:] @ self.rotation))


@dataclass(frozen=True, eq=False)
class MeasuredTriad:
    """A triad found in a stereo pair: the name of its model, its balls by name, and its pose.

    ``error_mm`` is the distance-matrix error of eq. 5.17, of the balls that both views show; it finds gross
    faults and says nothing of accuracy. ``pose`` is None when the balls seen do not determine it; then
    ``reason`` says so, and ``balls`` are those that both views show.
    """

    model: str
    balls: Mapping[str, Ball]
    pose: Pose | None
    error_mm: float
    reason: str | None = None

    @property
    def place_mm(self) -> Float:
        """P (3,), or the middle of the balls that were seen when there is no pose."""
        if self.pose is not None:
            return self.pose.position_mm
        return np.asarray(np.mean([ball.position_mm for ball in self.balls.values()], axis=0))
