"""Sub-pixel centres of balls with covariance: the best proposals of both views, refined by larger networks.

There are three passes. First a few of the best proposals, for what the balls of a view share but the rig does not
determine: their size, because the wound may be nearer or farther than where the optical axes meet, the direction of the
lamp, and their mean patch. Then the best proposals with these known. Last the best of these rotated by 180 degrees
(`spinewatch.detection.refinement.orientations`).

At first one network sees the upright patches and another one, of different training, the rotated ones. As long as the
balls look usual (`spinewatch.detection.refinement.look`), that is as accurate as the larger network in every pass, at a
third of the cost. When they do not, all passes are made again with the larger network, which is fitted to all looks,
and the best proposals are seen mirrored too. Large balls have one network, which sees all orientations.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.detection.features import HIDDEN, DiscardedCandidates, Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.duplicates import nearest, without_duplicates
from spinewatch.detection.refinement.lamp import LampEstimates, estimate_lamp
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.look import Look, is_usual
from spinewatch.detection.refinement.networks import BallNetwork
from spinewatch.detection.refinement.orientations import (
    MIRRORED,
    ROTATED,
    PatchPredictor,
    Turn,
    mean_centres,
)
from spinewatch.detection.refinement.outlines import outline_offsets
from spinewatch.detection.refinement.proposals import Proposals, ball_scores, size_ratio
from spinewatch.parallel import both


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
        parts = [_Part(view, view.networks[-1], view.networks[0], (ROTATED,)) for view in proposals]
        views, looks = _refine_both(parts, p, pool, min_score)
        if is_usual(looks, p.look):
            return views
    turns = (ROTATED, MIRRORED)
    parts = [_Part(view, view.networks[0], view.networks[0], turns) for view in proposals]
    views, _ = _refine_both(parts, p, pool, min_score)
    return views


@dataclass(frozen=True, eq=False)
class _Part:
    """A view with the networks for its upright and for its turned patches, and how these are turned."""

    view: Proposals
    for_upright: BallNetwork
    for_turned: BallNetwork
    turns: tuple[Turn, ...]


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
    is_ball
        Which of the proposals are probable balls in view, among the best ones, shape (n,).
    """

    ball_px: Float
    lamp: LampEstimates
    centre: Float
    is_ball: Bool


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
    predictor = PatchPredictor(network, view.tone, view.ball_px, expected, p.max_shift)
    centre, best = view.centre.copy(), _best(view.score, p.n_shared)
    refined, centre[best] = predictor.at(centre[best])
    balls = refined.probable(p.min_odds)
    lamp = LampEstimates(view.camera, view.lamp, refined.lamp[balls], refined.lamp_sd[balls])
    is_ball = np.zeros(len(centre), dtype=bool)
    is_ball[best] = refined.in_view(p.min_odds)
    return Shared(view.ball_px * size_ratio(refined, p), lamp, centre, is_ball)


def _refine(
    part: _Part, shared: Shared, lighting: Lighting, p: CentreParameters, min_score: float
) -> tuple[RefinedView, Look]:
    """Return the features of one view and how its balls look, given its light."""
    view, ball_px, centre = part.view, shared.ball_px, shared.centre
    for_upright, for_turned = (
        PatchPredictor(network, view.tone, ball_px, lighting, p.max_shift)
        for network in (part.for_upright, part.for_turned)
    )
    covariance, visible, score = (a.copy() for a in (view.covariance, view.visible, view.score))
    refined = _best(score, p.n_refined)
    upright, centre[refined] = for_upright.at(centre[refined], is_ball=shared.is_ball[refined])
    covariance[refined], visible[refined] = upright.covariance_px2(ball_px), upright.visible
    score[refined] = ball_scores(upright, view.similarity[refined], p)

    first = _best(score[refined], p.n_rotated)
    first = first[score[refined[first]] >= min_score]
    best = refined[first]
    is_ball = upright.in_view(p.min_odds)[first]
    turned, centres = zip(*(for_turned.at(centre[best], turn, is_ball) for turn in part.turns), strict=True)
    mean = mean_centres(
        [centre[best], *centres],
        [covariance[best], *(seen.covariance_px2(ball_px) for seen in turned)],
        p.rotation_correlation,
    )
    centre[best], covariance[best] = mean.centre, mean.covariance
    look = Look(
        upright.probable(p.look.min_odds)[first],
        turned[0].probable(p.look.min_odds),
        _sd_radii(mean.of_one, ball_px),
    )

    ranked = _best(score, len(score))
    order = ranked[without_duplicates(centre[ranked] / (ball_px / 2), p.merge_radius)][: p.n_kept]
    stated = covariance[order] + np.diag(np.square(p.model_sd * ball_px / 2))
    outline = centre[order]
    xy_px = outline - outline_offsets(view.camera, outline, ball_px[0])
    features = Features(xy_px, score[order], stated, visible[order])
    rest = ranked[~np.isin(ranked, order)]
    same = nearest(centre[rest] / (ball_px / 2), centre[order] / (ball_px / 2), p.merge_radius)
    return RefinedView(features, DiscardedCandidates(centre[rest], score[rest], same != HIDDEN, same)), look


def _best(score: Float, count: int) -> Int:
    """Return the indices of the highest scores (n,), best first."""
    return np.argsort(-score, kind="stable")[:count]


def _sd_radii(covariance: Float, ball_px: Float) -> Float:
    """Return the standard deviations per axis (n,), radii, of covariances (n, 2, 2), px^2, for a size (2,) of balls."""
    return np.asarray(np.sqrt((covariance.diagonal(axis1=1, axis2=2) / np.square(ball_px / 2)).mean(axis=1)))
