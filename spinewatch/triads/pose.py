"""Poses of triads and what was measured of each: result types; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from spinewatch.arrays import Float
from spinewatch.markers import FLAT_10_14_18, TriadModel

if TYPE_CHECKING:
    from spinewatch.detection.placed_centres import PlacedCentre
    from spinewatch.imaging.frame import Side


DOUBTFUL = "it is doubtful"
"""How the reason of a triad begins that has no pose because it may be false."""


@dataclass(frozen=True, eq=False)
class Ball:
    """One ball of a marker.

    Attributes
    ----------
    position_mm
        Centre, shape (3,), object space, mm: triangulated, or from the pose of the marker if an image does not show it.
    covariance_mm2
        Its covariance, shape (3, 3), mm^2.
    left_px, right_px
        Its images (u, v), shape (2,), px; None where hidden.
    parallax_mm
        Distance between its two rays, mm; None where it is hidden.
    manual_in
        Images in which a person placed its centre.
    placed
        By image, the centre that a person placed beside what was detected there.
    """

    position_mm: Float
    covariance_mm2: Float
    left_px: Float | None
    right_px: Float | None
    parallax_mm: float | None
    manual_in: tuple[Side, ...] = ()
    placed: Mapping[Side, PlacedCentre] = field(default_factory=dict)

    def image_px(self, side: Side) -> Float | None:
        """Return its image in one view.

        Parameters
        ----------
        side
            The view.

        Returns
        -------
        Float or None
            Image (u, v), shape (2,), px; None where hidden.
        """
        return self.left_px if side == "left" else self.right_px

    @property
    def hidden_in(self) -> tuple[str, ...]:
        """Names of the images that do not show it."""
        sides = (("left", self.left_px), ("right", self.right_px))
        return tuple(side for side, image in sides if image is None)


@dataclass(frozen=True, eq=False)
class Pose:
    """Position and orientation of a triad in object space.

    Attributes
    ----------
    position_mm
        P, shape (3,), mm.
    rotation
        Rotation from marker to object axes, shape (3, 3); its columns are the axes of the triad: x from MX to XX, z the
        normal.
    covariance
        Covariance of the position (mm) and of a small rotation vector about the OBJECT axes (degrees), shape (6, 6),
        with ``R_true = Exp(dtheta) R``.

    References
    ----------
    Thesis section 5.7 and fig. 5.7, which describe a triad by P and its normal only.

    Examples
    --------
    >>> import numpy as np
    >>> pose = Pose(np.zeros(3), np.eye(3), np.diag([0.01, 0.01, 0.04, 1.0, 1.0, 0.25]))
    >>> pose.angles_deg
    array([90., 90.,  0.])
    >>> pose.rotation_sd_deg
    array([1. , 1. , 0.5])
    """

    position_mm: Float
    rotation: Float
    covariance: Float

    @property
    def normal(self) -> Float:
        """Unit normal, shape (3,): the thesis's orientation of a triad (fig. 5.7)."""
        return self.rotation[:, 2]

    @property
    def angles_deg(self) -> Float:
        """Angles (alpha, beta, gamma) of the normal with the object axes X, Y, Z, shape (3,), degrees."""
        return np.degrees(np.arccos(np.clip(self.normal, -1, 1)))

    @property
    def position_sd_mm(self) -> Float:
        """Standard deviations of the position along the object axes, shape (3,), mm."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def rotation_sd_deg(self) -> Float:
        """Standard deviations of the rotation about the triad's own x, y and z axes, shape (3,), degrees."""
        return np.sqrt(np.diag(self.rotation.T @ self.covariance[3:, 3:] @ self.rotation))


@dataclass(frozen=True, eq=False)
class MeasuredTriad:
    """A triad that was found in a stereo pair.

    Attributes
    ----------
    model
        Name of its marker.
    balls
        Its balls by name; without a pose only those that both images show.
    pose
        Its pose; None if the visible balls do not determine it.
    error_mm
        Error of the distance matrix (eq. 5.17) of the balls that both images show, mm. It reveals gross errors and is
        no measure of accuracy.
    reason
        Why there is no pose; None if there is one.
    chi2
        Chi-square of the residuals of its ball images.
    dof
        Degrees of freedom of that.
    chance_false
        Chance that it is at a wrong place or has a wrong ball; None if it was not rated, or if a person placed a ball.
    doubtful
        Whether it has no pose because of that chance, or because most triads of its stage are doubtful.
    """

    model: str
    balls: Mapping[str, Ball]
    pose: Pose | None
    error_mm: float
    reason: str | None = None
    chi2: float = 0.0
    dof: int = 0
    chance_false: float | None = None
    doubtful: bool = False

    @property
    def position_mm(self) -> Float:
        """P, or the mean of the balls that both images show if there is no pose, shape (3,), object space, mm."""
        if self.pose is not None:
            return self.pose.position_mm
        return np.asarray(np.mean([ball.position_mm for ball in self.balls.values()], axis=0))


def ball_centres(poses: Sequence[Pose], model: TriadModel = FLAT_10_14_18) -> Float:
    """Return the ball centres of triads with the same marker.

    Parameters
    ----------
    poses
        Poses of t triads.
    model
        Their marker, with n balls.

    Returns
    -------
    Float
        Centres, shape (t, n, 3), object space, mm.
    """
    return np.stack([pose.position_mm + model.coordinates_mm @ pose.rotation.T for pose in poses])
