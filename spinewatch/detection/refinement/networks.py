"""Small convolutional networks that estimate from a patch whether it shows a ball, and the ball's centre.

They were trained with simulated images only (``training/``). The light of the view is an input
(`spinewatch.detection.refinement.lighting`), and of most networks the mean patch of the view's other balls
(`spinewatch.detection.refinement.other_balls`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from spinewatch.arrays import Bool, Float, Single
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_graph import Layer, NetworkGraph
from spinewatch.detection.refinement.other_balls import MIN_VISIBLE, mean_of_other_balls
from spinewatch.detection.refinement.patches import PatchGrid

_CONTRAST_FLOOR = np.float32(0.05)
"""Part of the networks' definition: patches whose log gray levels vary by less than about this stay faint."""

MIN_CONTRAST = 0.04
"""Least standard deviation of the log gray levels of a patch that shows a ball; in a fainter one none can be seen."""
_NO_BALL = -8.0
"""Log-odds of a ball in a fainter patch."""

OUTPUTS = (
    "log_odds",
    "u",
    "v",
    "log_u",
    "log_v",
    "off_diagonal",
    "visible",
    "log_size",
    "lamp_u",
    "lamp_v",
    "log_lamp",
)
"""Outputs of the last layer, in order."""

_COLUMNS = (0, np.s_[1:3], np.s_[3:5], 5, 6, 7, np.s_[8:10], 10)
"""Columns of the outputs, those of the same kind together."""


@dataclass(frozen=True)
class OutputScales:
    """Scales that turn the networks' outputs, all of order 1, into estimates.

    Attributes
    ----------
    offset
        Unit of ``u`` and ``v``, radii of the ball.
    log_precision
        Added to ``log_u`` and ``log_v`` to give the logarithms of precisions, per radius.
    log_size
        Unit of ``log_size``.
    lamp
        Unit of ``lamp_u`` and ``lamp_v``, on the unit sphere.
    log_lamp
        Added to ``log_lamp`` to give the logarithm of the precision of the lamp direction.
    dof
        Degrees of freedom of Student's t distribution whose likelihood was maximized in training.
    """

    offset: float = 0.3
    log_precision: float = 3.0
    log_size: float = 0.1
    lamp: float = 0.3
    log_lamp: float = 2.0
    dof: float = 8.0


SCALES = OutputScales()


@dataclass(frozen=True, eq=False)
class BallNetwork:
    """A network for balls of a range of sizes.

    All layers except the last are rectified; the last has a single window, with the `OUTPUTS` as channels.

    Attributes
    ----------
    grid
        Samples of its patches.
    min_width_px
        Least width of balls that it is for, px.
    layers
        Its layers, first to last.
    """

    grid: PatchGrid
    min_width_px: float
    layers: tuple[Layer, ...]

    @property
    def sees_others(self) -> bool:
        """Whether the mean patch of the other balls is its second image."""
        return bool(self.layers[0].weights.shape[2] > 1)

    @cached_property
    def graph(self) -> NetworkGraph:
        """The network ready to be evaluated, prepared when it is first used."""
        return NetworkGraph(self.layers, self.grid.size)


@dataclass(frozen=True, eq=False)
class BallNetworks:
    """The networks of the detector.

    Attributes
    ----------
    proposal
        Small network that ranks all candidates.
    refinement
        Larger networks that estimate the centres of the best candidates: one or several for each size of ball, that for
        all looks first and that for usual looks last.
    """

    proposal: BallNetwork
    refinement: tuple[BallNetwork, ...]

    def refinement_networks(self, width_px: float) -> tuple[BallNetwork, ...]:
        """Return the refinement networks for a size of balls.

        Parameters
        ----------
        width_px
            Width of a ball, px.

        Returns
        -------
        tuple of BallNetwork
            The networks of the greatest ``min_width_px`` that does not exceed the width.
        """
        least = max(n.min_width_px for n in self.refinement if n.min_width_px <= width_px)
        return tuple(network for network in self.refinement if network.min_width_px == least)


@dataclass(frozen=True, eq=False)
class BallEstimates:
    """Estimates from n patches; lengths in radii of the ball, u right, v down.

    All except the log-odds hold on condition that there is a ball.

    Attributes
    ----------
    log_odds
        Log-odds of a ball in the middle, shape (n,).
    offset
        Centre of its outline from the middle of the patch, shape (n, 2).
    covariance
        Covariance of the offset, shape (n, 2, 2).
    visible
        Visible fraction of the outline, 0 to 1, shape (n,).
    log_size
        Logarithm of the ball's size over the size that the patch was cut for, shape (n,).
    lamp
        Lamp direction, (u, v) part of the unit vector, shape (n, 2).
    lamp_sd
        Standard deviation of the lamp direction per axis, shape (n,).
    """

    log_odds: Float
    offset: Float
    covariance: Float
    visible: Float
    log_size: Float
    lamp: Float
    lamp_sd: Float

    def probable(self, min_odds: float) -> Bool:
        """Return which patches show a ball of some odds at least.

        Parameters
        ----------
        min_odds
            Least odds of a ball, which are exceeded.

        Returns
        -------
        Bool
            Mask, shape (n,).
        """
        return np.asarray(self.log_odds > np.log(min_odds))

    def in_view(self, min_odds: float) -> Bool:
        """Return which patches show a ball of some odds at least, most of it in view.

        Parameters
        ----------
        min_odds
            Least odds of a ball, which are exceeded.

        Returns
        -------
        Bool
            Mask, shape (n,).
        """
        return self.probable(min_odds) & (self.visible > MIN_VISIBLE)

    def covariance_px2(self, ball_px: Float) -> Float:
        """Return the covariances of the centres in the image.

        Parameters
        ----------
        ball_px
            Width and height of a ball, shape (2,), px.

        Returns
        -------
        Float
            Covariances, shape (n, 2, 2), px^2.
        """
        return np.asarray(self.covariance * np.outer(ball_px, ball_px) / 4)


def predict_balls(
    network: BallNetwork, patches: Single, lighting: Lighting, is_ball: Bool | None = None
) -> BallEstimates:
    """Return a network's estimates from patches.

    Parameters
    ----------
    network
        The network.
    patches
        Log gray levels, shape (n, size, size).
    lighting
        Light of the view.
    is_ball
        Which of the patches, all of one view, show balls, shape (n,); None when none is known to.

    Returns
    -------
    BallEstimates
        Estimates from n patches.

    Examples
    --------
    >>> from spinewatch.detection.refinement.network_file import default_networks
    >>> even = np.zeros((1, 25, 25), np.float32)
    >>> network, lighting = default_networks().proposal, Lighting.expected(np.zeros(2))
    >>> bool(predict_balls(network, even, lighting).log_odds[0] < 0)
    True
    """
    known = np.zeros(len(patches), dtype=bool) if is_ball is None else is_ball
    out = network.graph(_images(network, normalize(patches), known), lighting.inputs).astype(float)
    log_odds, offset, log_precision, off_diagonal, visible, log_size, lamp, log_lamp = (
        out[:, columns] for columns in _COLUMNS
    )
    # The inverse covariance is the product L^T L of L = [[1/a, off_diagonal/b], [0, 1/b]].
    a, b = np.exp(-log_precision - SCALES.log_precision).T
    covariance = np.empty((len(out), 2, 2))
    covariance[:, 0, 0], covariance[:, 1, 1] = (1 + off_diagonal**2) * a**2, b**2
    covariance[:, 0, 1] = covariance[:, 1, 0] = -off_diagonal * a * b
    covariance *= SCALES.dof / (SCALES.dof - 2)
    return BallEstimates(
        np.where(patches.std(axis=(1, 2)) > MIN_CONTRAST, log_odds, _NO_BALL),
        SCALES.offset * offset,
        covariance,
        1 / (1 + np.exp(-visible)),
        SCALES.log_size * log_size,
        SCALES.lamp * lamp,
        np.exp(-log_lamp - SCALES.log_lamp),
    )


def _images(network: BallNetwork, patches: Single, is_ball: Bool) -> Single:
    """Return what a network sees of n normalized patches, shape (n, channels, size, size)."""
    images = (patches, mean_of_other_balls(patches, is_ball)) if network.sees_others else (patches,)
    return np.stack(images, axis=1)


def predict_turned(
    network: BallNetwork,
    patches: Single,
    lighting: Lighting,
    turn: tuple[int, int],
    is_ball: Bool | None = None,
) -> BallEstimates:
    """Return a network's estimates from patches that it sees mirrored or rotated by 180 degrees.

    Parameters
    ----------
    network
        The network.
    patches
        Log gray levels, shape (n, size, size), upright.
    lighting
        Light of the view, upright.
    turn
        Signs of u and of v in what the network sees.
    is_ball
        Which of the patches show balls, shape (n,); None when none is known to.

    Returns
    -------
    BallEstimates
        Estimates from n patches, of the upright ones.
    """
    sign = np.array(turn)
    seen = predict_balls(network, patches[:, :: turn[1], :: turn[0]], lighting.turned(turn), is_ball)
    return replace(
        seen,
        offset=sign * seen.offset,
        covariance=np.outer(sign, sign) * seen.covariance,
        lamp=sign * seen.lamp,
    )


def normalize(patches: Single) -> Single:
    """Return patches of mean 0 and variance 1, except faint ones, which stay faint.

    Parameters
    ----------
    patches
        Log gray levels, shape (n, h, w).

    Returns
    -------
    Single
        Normalized patches, shape (n, h, w).

    Examples
    --------
    >>> normalize(np.array([[[1.0, 21.0]]], np.float32)).round(2)
    array([[[-1.,  1.]]], dtype=float32)
    """
    x = patches - patches.mean(axis=(1, 2), keepdims=True)
    spread = np.sqrt(np.einsum("nhw,nhw->n", x, x) / (x.shape[1] * x.shape[2]))
    x /= spread[:, None, None] + _CONTRAST_FLOOR
    return np.asarray(x)
