"""Candidates of a view ranked by the proposal network, a small one, before the larger networks refine the best."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from statistics import median

import numpy as np

from spinewatch.arrays import Float, Single
from spinewatch.camera import Camera
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.networks import BallEstimates, BallNetwork, BallNetworks
from spinewatch.detection.refinement.orientations import PatchPredictor
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.tone import patch_tone


@dataclass(frozen=True, eq=False)
class NominalView:
    """What the rig determines of the balls in one view.

    Attributes
    ----------
    camera
        Camera of the view.
    ball_px
        Width and height of a ball at the nominal range, px.
    lamp
        Expected lamp direction: (u, v) part of the unit vector from the balls to the lamp, shape (2,).
    """

    camera: Camera
    ball_px: tuple[float, float]
    lamp: Float


@dataclass(frozen=True, eq=False)
class Proposals:
    """The n candidates of one view after the proposal network.

    Attributes
    ----------
    camera
        Camera of the view.
    networks
        Refinement networks for the size of the balls: that for all looks first, that for usual looks last.
    tone
        Log gray levels, shape (H, W).
    similarity
        Template similarity in [0, 1], shape (n,).
    centre
        Centres of outlines (u, v), shape (n, 2), px.
    covariance
        Covariances of the centres, shape (n, 2, 2), px^2.
    visible
        Visible fraction of the outlines, 0 to 1, shape (n,).
    score
        Scores in [0, 1], shape (n,).
    ball_px
        Width and height of a ball, shape (2,), px.
    lamp
        Expected lamp direction, shape (2,).
    """

    camera: Camera
    networks: tuple[BallNetwork, ...]
    tone: Single
    similarity: Float
    centre: Float
    covariance: Float
    visible: Float
    score: Float
    ball_px: Float
    lamp: Float


def propose(
    view: NominalView,
    frame: Frame,
    candidates: Features,
    networks: BallNetworks,
    parameters: CentreParameters,
) -> Proposals:
    """Return the candidates of a view ranked by the proposal network.

    Parameters
    ----------
    view
        Camera, nominal size of balls and expected lamp direction.
    frame
        Image of the view.
    candidates
        n candidates, scored by template similarity.
    networks
        Proposal and refinement networks.
    parameters
        Counts and thresholds.

    Returns
    -------
    Proposals
        n proposals, in the order of the candidates.
    """
    p = parameters
    tone, nominal_px = patch_tone(frame.gray()), np.array(view.ball_px)
    expected = Lighting.expected(view.lamp)
    predictor = PatchPredictor(networks.proposal, tone, nominal_px, expected, p.max_shift)
    proposed, centre = predictor.at(candidates.xy_px)
    # Balls that appear larger are nearer; there the lamp is at a larger angle to the optical axis.
    ratio = size_ratio(proposed, p)
    return Proposals(
        view.camera,
        networks.refinement_networks(view.ball_px[0]),
        tone,
        candidates.score,
        centre,
        proposed.covariance_px2(nominal_px),
        proposed.visible,
        ball_scores(proposed, candidates.score, p),
        nominal_px * ratio,
        view.lamp * ratio,
    )


def size_ratio(estimates: BallEstimates, parameters: CentreParameters) -> float:
    """Return how much larger the balls of a view are than the patches were cut for.

    Parameters
    ----------
    estimates
        Estimates from n patches of the view.
    parameters
        Least odds and least number of the balls that count.

    Returns
    -------
    float
        Median ratio of the probable balls; 1 when they are too few.
    """
    p = parameters
    balls = estimates.probable(p.min_odds)
    return exp(median(estimates.log_size[balls].tolist())) if balls.sum() >= p.min_balls else 1.0


def ball_scores(estimates: BallEstimates, similarity: Float, parameters: CentreParameters) -> Float:
    """Return scores that combine log-odds and template similarity.

    Parameters
    ----------
    estimates
        Estimates from n patches.
    similarity
        Template similarity of their places in [0, 1], shape (n,).
    parameters
        Limit of the log-odds, and the weight of the similarity.

    Returns
    -------
    Float
        Scores in [0, 1], shape (n,): the weighted sum.
    """
    p = parameters
    log_odds = estimates.log_odds.clip(-p.max_log_odds, p.max_log_odds)
    return np.asarray(
        (similarity + (log_odds + p.max_log_odds) / p.template_weight)
        / (1 + 2 * p.max_log_odds / p.template_weight)
    )
