"""Patches that a network sees upright, mirrored or rotated, and the mean of what it estimates from several of them.

The errors in two orientations are only partly correlated, so that the mean of their estimates is more accurate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Single
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.networks import BallEstimates, BallNetwork, predict_turned
from spinewatch.detection.refinement.patches import cut_patches

Turn = tuple[int, int]
"""Signs of u and v in an orientation of patches."""

UPRIGHT: Turn = (1, 1)
ROTATED: Turn = (-1, -1)
MIRRORED: Turn = (-1, 1)


@dataclass(frozen=True, eq=False)
class PatchPredictor:
    """A network and what the patches of a view share.

    Attributes
    ----------
    network
        The network.
    tone
        Log gray levels, shape (H, W).
    ball_px
        Width and height of a ball, shape (2,), px.
    lighting
        Light of the view.
    max_shift
        Greatest distance per axis of a centre from the middle of its patch, radii of the ball.
    """

    network: BallNetwork
    tone: Single
    ball_px: Float
    lighting: Lighting
    max_shift: float

    def at(
        self, positions_px: Float, turn: Turn = UPRIGHT, is_ball: Bool | None = None
    ) -> tuple[BallEstimates, Float]:
        """Return estimates from patches in an orientation.

        Parameters
        ----------
        positions_px
            Where the patches are cut, (u, v), shape (n, 2), px.
        turn
            Orientation in which the network sees them.
        is_ball
            Where balls are, as far as that is known, shape (n,); None where it is not.

        Returns
        -------
        estimates : BallEstimates
            Estimates from n patches, of the upright ones.
        centre : Float
            Centres of the outlines (u, v), shape (n, 2), px.
        """
        pixel = np.rint(positions_px).astype(np.intp)
        patches = cut_patches(self.tone, pixel, (self.ball_px[0], self.ball_px[1]), self.network.grid)
        estimates = predict_turned(self.network, patches, self.lighting, turn, is_ball)
        shift = estimates.offset.clip(-self.max_shift, self.max_shift)
        return estimates, pixel + shift * (self.ball_px / 2)


@dataclass(frozen=True, eq=False)
class MeanCentres:
    """Means of the centres that were estimated in several orientations; lengths in the unit of these.

    Attributes
    ----------
    centre
        Mean centres, shape (n, 2).
    covariance
        Their covariances, shape (n, 2, 2).
    of_one
        Covariances of the centre in one orientation, their mean, shape (n, 2, 2).
    """

    centre: Float
    covariance: Float
    of_one: Float


def mean_centres(centres: Sequence[Float], covariances: Sequence[Float], correlation: float) -> MeanCentres:
    """Return the means of centres that were estimated in several orientations.

    Parameters
    ----------
    centres
        Centres in each of k orientations, shape (n, 2).
    covariances
        Their covariances, shape (n, 2, 2), in the same order.
    correlation
        Correlation of the errors of two orientations, ``CentreParameters.rotation_correlation``.

    Returns
    -------
    MeanCentres
        Mean centres with covariances.

    Examples
    --------
    >>> centres = [np.array([[1.0, 2.0]]), np.array([[1.2, 2.0]])]
    >>> mean = mean_centres(centres, [np.eye(2)[None], np.eye(2)[None]], 0.8)
    >>> mean.centre.round(2).tolist(), mean.covariance.round(2).tolist()
    ([[1.1, 2.0]], [[[0.9, 0.0], [0.0, 0.9]]])
    """
    n_others = len(centres) - 1
    of_one = np.mean(covariances, axis=0)
    covariance = of_one * ((1 + n_others * correlation) / (1 + n_others))
    return MeanCentres(np.mean(centres, axis=0), covariance, of_one)
