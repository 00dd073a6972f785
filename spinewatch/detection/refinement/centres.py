"""Sub-pixel centres of balls with covariance, in two steps: `propose` per view, then `refine` for both views.

The proposal network, a small one, ranks all candidates of a view. Larger networks refine them, in three passes. First
a few of the best proposals, for what the balls of a view share but the rig does not determine: their size, because the
wound may be nearer or farther than where the optical axes meet, and the direction of the lamp. Then the best proposals
with both known. Last the best of these rotated by 180 degrees: the errors in the two orientations are only partly
correlated, so that their mean is more accurate.

At first one network sees the upright patches and another one, of different training, the rotated ones. As long as the
balls look usual (`spinewatch.detection.refinement.look`), that is as accurate as the larger network in every pass, at a
third of the cost. When they do not, all passes are made again with the larger network, which is fitted to all looks,
and the best proposals are seen mirrored too.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from math import exp
from statistics import median

import numpy as np
from scipy.spatial import cKDTree

from spinewatch.arrays import Bool, Float, Int, Single
from spinewatch.camera import Camera
from spinewatch.detection.features import HIDDEN, DiscardedCandidates, Features
from spinewatch.detection.refinement.lamp import LampEstimates, estimate_lamp
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.look import Look, LookParameters, is_usual
from spinewatch.detection.refinement.networks import (
    BallEstimates,
    BallNetwork,
    BallNetworks,
    predict_turned,
)
from spinewatch.detection.refinement.outlines import outline_offsets
from spinewatch.detection.refinement.patches import cut_patches
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.tone import patch_tone
from spinewatch.parallel import both


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of `propose` and `refine`; lengths in radii of the ball.

    Attributes
    ----------
    n_shared
        Number of best proposals per view from which the size of the balls and the light are estimated.
    n_refined
        Number of best proposals per view that are refined.
    n_rotated
        Number of the best of these that are refined in all orientations.
    n_kept
        Number of features per view to return at most.
    min_odds
        Least odds of a ball for an estimate to contribute to the size of the balls and the light.
    min_balls
        Least number of such estimates. With fewer the nominal size holds, and the light counts as not measured.
    height
        Height of the balls over the tissue, with which the networks expect their shadows; 9.5 is the middle of the
        worlds that they were fitted to, 38 mm for balls of 8 mm.
    lamp_sd_rad
        Standard deviation per axis of the lamp's direction about that of the point midway between the cameras, radians.
    merge_radius
        Features whose centres are closer than this are one.
    max_shift
        Greatest distance per axis of a centre from its candidate.
    rotation_correlation
        Correlation of the errors of two orientations, measured on simulated images.
    model_sd
        Standard deviation per axis of errors on real images that simulated images do not have.
    max_log_odds
        A network's log-odds are clipped to this magnitude.
    template_weight
        Log-odds that correspond to a template similarity of 1; a blood clot may deceive either criterion.
    manual_sd
        Standard deviation per axis of a centre that a person places in an enlarged image: 0.6 px for a ball of 10 px.
    look
        Limits of a usual look.
    """

    n_shared: int = 24
    n_refined: int = 60
    n_rotated: int = 24
    n_kept: int = 150
    min_odds: float = 30.0
    min_balls: int = 4
    height: float = 9.5
    lamp_sd_rad: float = 0.11
    merge_radius: float = 0.4
    max_shift: float = 0.7
    rotation_correlation: float = 0.8
    model_sd: float = 0.008
    max_log_odds: float = 6.0
    template_weight: float = 20.0
    manual_sd: float = 0.12
    look: LookParameters = field(default_factory=LookParameters)


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
    predictor = _Predictor(networks.proposal, tone, nominal_px, expected, p.max_shift)
    proposed, centre = predictor.at(candidates.xy_px)
    # Balls that appear larger are nearer; there the lamp is at a larger angle to the optical axis.
    ratio = _size_ratio(proposed, p)
    return Proposals(
        view.camera,
        networks.refinement_networks(view.ball_px[0]),
        tone,
        candidates.score,
        centre,
        _covariance_px2(proposed, nominal_px),
        proposed.visible,
        _score(proposed, candidates.score, p),
        nominal_px * ratio,
        view.lamp * ratio,
    )


@dataclass(frozen=True, eq=False)
class RefinedView:
    """The balls of one view.

    Attributes
    ----------
    features
        Features with refined centres, most probable balls first.
    discarded
        Candidates that are none of them.
    """

    features: Features
    discarded: DiscardedCandidates


def refine(
    proposals: tuple[Proposals, Proposals],
    parameters: CentreParameters,
    pool: Executor | None = None,
    *,
    any_look: bool = False,
    min_score: float = 0.0,
) -> tuple[RefinedView, RefinedView]:
    """Return the features of both views with refined centres, most probable balls first.

    Parameters
    ----------
    proposals
        Proposals of the left and the right view.
    parameters
        Counts and thresholds.
    pool
        Executes the right view at the same time as the left one; None for one after the other.
    any_look
        Whether the network for all looks makes all passes, whether or not the balls look usual.
    min_score
        Least score of a feature that is refined in all orientations.

    Returns
    -------
    tuple of RefinedView
        Left and right features: centres of the balls' images, px, with covariances. Scores combine the network's odds
        and the template similarity. Proposals of the same ball are one feature.
    """
    p = parameters
    if not any_look:
        parts = [_Part(view, view.networks[-1], view.networks[0], (_ROTATED,)) for view in proposals]
        views, looks = _refine_both(parts, p, pool, min_score)
        if is_usual(looks, p.look):
            return views
    turns = (_ROTATED, _MIRRORED)
    parts = [_Part(view, view.networks[0], view.networks[0], turns) for view in proposals]
    views, _ = _refine_both(parts, p, pool, min_score)
    return views


_Turn = tuple[int, int]
"""Signs of u and v in an orientation of patches."""

_UPRIGHT: _Turn = (1, 1)
_ROTATED: _Turn = (-1, -1)
_MIRRORED: _Turn = (-1, 1)


@dataclass(frozen=True, eq=False)
class _Part:
    """A view with the networks for its upright and for its turned patches, and how these are turned."""

    view: Proposals
    for_upright: BallNetwork
    for_turned: BallNetwork
    turns: tuple[_Turn, ...]


def _refine_both(
    parts: Sequence[_Part], p: CentreParameters, pool: Executor | None, min_score: float
) -> tuple[tuple[RefinedView, RefinedView], tuple[Look, Look]]:
    """Return the features of both views, and how their balls look."""
    shared = both(lambda part: measure_shared(part.view, part.for_upright, p), parts[0], parts[1], pool)
    lamps = estimate_lamp([view.lamp for view in shared], p.lamp_sd_rad)
    if max(len(view.lamp.sd) for view in shared) >= p.min_balls:
        light = [Lighting.measured(lamp, p.height) for lamp in lamps]
    else:
        light = [Lighting.expected(lamp) for lamp in lamps]
    left, right = zip(parts, shared, light, strict=True)
    (left_view, left_look), (right_view, right_look) = both(
        lambda part: _refine(*part, p, min_score), left, right, pool
    )
    return (left_view, right_view), (left_look, right_look)


@dataclass(frozen=True, eq=False)
class Shared:
    """What the balls of one view share.

    Attributes
    ----------
    ball_px
        Width and height of a ball, shape (2,), px.
    lamp
        Lamp directions estimated from the most probable balls.
    centre
        Centres of the outlines of all proposals, shape (n, 2), px; those of the best ones refined.
    """

    ball_px: Float
    lamp: LampEstimates
    centre: Float


def measure_shared(view: Proposals, network: BallNetwork, p: CentreParameters) -> Shared:
    """Return what the balls of a view share, estimated from its best proposals.

    Parameters
    ----------
    view
        Proposals of the view.
    network
        Refinement network.
    p
        Counts and thresholds.

    Returns
    -------
    Shared
        Size of the balls and estimates of the lamp direction.
    """
    expected = Lighting.expected(view.lamp)
    predictor = _Predictor(network, view.tone, view.ball_px, expected, p.max_shift)
    centre, best = view.centre.copy(), _best(view.score, p.n_shared)
    refined, centre[best] = predictor.at(centre[best])
    balls = _probable(refined, p.min_odds)
    lamp = LampEstimates(view.camera, view.lamp, refined.lamp[balls], refined.lamp_sd[balls])
    return Shared(view.ball_px * _size_ratio(refined, p), lamp, centre)


def _refine(
    part: _Part, shared: Shared, lighting: Lighting, p: CentreParameters, min_score: float
) -> tuple[RefinedView, Look]:
    """Return the features of one view and how its balls look, given its light."""
    view, ball_px, centre = part.view, shared.ball_px, shared.centre
    for_upright, for_turned = (
        _Predictor(network, view.tone, ball_px, lighting, p.max_shift)
        for network in (part.for_upright, part.for_turned)
    )
    covariance, visible, score = (a.copy() for a in (view.covariance, view.visible, view.score))
    refined = _best(score, p.n_refined)
    upright, centre[refined] = for_upright.at(centre[refined])
    covariance[refined], visible[refined] = _covariance_px2(upright, ball_px), upright.visible
    score[refined] = _score(upright, view.similarity[refined], p)

    first = _best(score[refined], p.n_rotated)
    first = first[score[refined[first]] >= min_score]
    best = refined[first]
    turned, centres = zip(*(for_turned.at(centre[best], turn) for turn in part.turns), strict=True)
    centre[best] = np.mean([centre[best], *centres], axis=0)
    mean_covariance = np.mean(
        [covariance[best], *(_covariance_px2(seen, ball_px) for seen in turned)], axis=0
    )
    n = len(part.turns)
    covariance[best] = mean_covariance * ((1 + n * p.rotation_correlation) / (1 + n))
    look = Look(
        _probable(upright, p.look.min_odds)[first],
        _probable(turned[0], p.look.min_odds),
        _sd_radii(mean_covariance, ball_px),
    )

    ranked = _best(score, len(score))
    order = ranked[_without_duplicates(centre[ranked] / (ball_px / 2), p.merge_radius)][: p.n_kept]
    stated = covariance[order] + np.diag(np.square(p.model_sd * ball_px / 2))
    outline = centre[order]
    xy_px = outline - outline_offsets(view.camera, outline, ball_px[0])
    features = Features(xy_px, score[order], stated, visible[order])
    rest = ranked[~np.isin(ranked, order)]
    same = _nearest(centre[rest] / (ball_px / 2), centre[order] / (ball_px / 2), p.merge_radius)
    return RefinedView(features, DiscardedCandidates(centre[rest], score[rest], same != HIDDEN, same)), look


@dataclass(frozen=True, eq=False)
class _Predictor:
    """A network and what the patches share: log gray levels (H, W), ball size (2,), light."""

    network: BallNetwork
    tone: Single
    ball_px: Float
    lighting: Lighting
    max_shift: float

    def at(self, positions_px: Float, turn: _Turn = _UPRIGHT) -> tuple[BallEstimates, Float]:
        """Return estimates at positions (n, 2), px, from patches in an orientation, and centres (n, 2), px."""
        pixel = np.rint(positions_px).astype(np.intp)
        patches = cut_patches(self.tone, pixel, (self.ball_px[0], self.ball_px[1]), self.network.grid)
        estimates = predict_turned(self.network, patches, self.lighting, turn)
        shift = estimates.offset.clip(-self.max_shift, self.max_shift)
        return estimates, pixel + shift * (self.ball_px / 2)


def _best(score: Float, count: int) -> Int:
    """Return the indices of the highest scores (n,), best first."""
    return np.argsort(-score, kind="stable")[:count]


def _probable(estimates: BallEstimates, min_odds: float) -> Bool:
    """Return the mask (n,) of balls of some odds at least."""
    return np.asarray(estimates.log_odds > np.log(min_odds))


def _size_ratio(estimates: BallEstimates, p: CentreParameters) -> float:
    """Return the median size of the probable balls over that of the patches, 1 when they are too few."""
    balls = _probable(estimates, p.min_odds)
    return exp(median(estimates.log_size[balls].tolist())) if balls.sum() >= p.min_balls else 1.0


def _score(estimates: BallEstimates, similarity: Float, p: CentreParameters) -> Float:
    """Return scores (n,) in [0, 1]: the weighted sum of log-odds and template similarity (n,)."""
    log_odds = estimates.log_odds.clip(-p.max_log_odds, p.max_log_odds)
    return np.asarray(
        (similarity + (log_odds + p.max_log_odds) / p.template_weight)
        / (1 + 2 * p.max_log_odds / p.template_weight)
    )


def _covariance_px2(estimates: BallEstimates, ball_px: Float) -> Float:
    """Return the covariances (n, 2, 2) of centres, px^2, for a size (2,) of balls, px."""
    return np.asarray(estimates.covariance * np.outer(ball_px, ball_px) / 4)


def _sd_radii(covariance: Float, ball_px: Float) -> Float:
    """Return the standard deviations per axis (n,), radii, of covariances (n, 2, 2), px^2, for a size (2,) of balls."""
    return np.asarray(np.sqrt((covariance.diagonal(axis1=1, axis2=2) / np.square(ball_px / 2)).mean(axis=1)))


def _nearest(positions: Float, others: Float, radius: float) -> Int:
    """Return the index of the nearest of others (m, 2) to positions (n, 2); `HIDDEN` where none is within a radius."""
    if not len(others) or not len(positions):
        return np.full(len(positions), HIDDEN)
    distance, index = cKDTree(others).query(positions)
    return np.where(distance <= radius, index, HIDDEN)


def _without_duplicates(positions: Float, radius: float) -> Int:
    """Return the indices of positions (n, 2) that are farther than a radius from every retained earlier one."""
    kept = np.ones(len(positions), dtype=bool)
    for first, later in sorted(cKDTree(positions).query_pairs(radius)):
        kept[later] &= not kept[first]
    return np.flatnonzero(kept)
