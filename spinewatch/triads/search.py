"""From the features of a stereo pair to measured triads: MATCH-POINT in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Int
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.geometry.rays import Rays
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.identification import IdentificationParameters, Triplets, identify_triads
from spinewatch.matching.points import MatcherParameters, Points, match_features
from spinewatch.matching.selection import (
    HIDDEN,
    SelectionParameters,
    SpineAxis,
    TriadCandidates,
    select_triads,
    weigh_candidates,
)
from spinewatch.triads.occlusion import OcclusionParameters, occluded_candidates
from spinewatch.triads.pose import MeasuredTriad
from spinewatch.triads.pose_fit import PoseParameters, fit_poses

_CERTAIN = 1e4  # log-odds of a triad that was chosen already


@dataclass(frozen=True)
class SearchParameters:
    """Parameters of the whole search, one set a step."""

    matcher: MatcherParameters = field(default_factory=MatcherParameters)
    identify: IdentificationParameters = field(default_factory=IdentificationParameters)
    choose: SelectionParameters = field(default_factory=SelectionParameters)
    occlusion: OcclusionParameters = field(default_factory=OcclusionParameters)
    measure: PoseParameters = field(default_factory=PoseParameters)


@dataclass(frozen=True, eq=False)
class TriadSearch:
    """The triads of a stereo pair in order along the spine axis, with what led to them.

    ``chosen`` are the triads' features, ``triplets`` those of each model.
    """

    triads: tuple[MeasuredTriad, ...]
    chosen: TriadCandidates
    points: Points
    triplets: tuple[Triplets, ...]
    flags: tuple[Flag, ...]


def match_triads(
    left: Features,
    right: Features,
    rig: Rig,
    parameters: SearchParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
    images: tuple[NDArray[np.generic], NDArray[np.generic]] | None = None,
    models: Sequence[TriadModel] = (FLAT_10_14_18,),
) -> TriadSearch:
    """Return the triads that the features of a stereo pair show, never more than ``expected``.

    Triads in full view are chosen first. Where some are missing, or their number is unknown, triads with a
    hidden ball are sought among the features left over and flagged "ball-occluded". Fewer than expected are
    flagged "triad-count-low" (H5), never filled up by doubtful ones. ``models`` are the markers in use.
    ``images`` serve structural refinement only. Raises ``ParameterError`` when the range cannot be derived
    from the rig.
    """
    points = match_features(left, right, rig, parameters.matcher, images)
    triplets = tuple(identify_triads(points, model, parameters.identify) for model in models)
    pool = weigh_candidates(triplets, points, models, rig, parameters.choose, expected)
    chosen = pool.take(select_triads(pool, points, parameters.choose, expected=expected, axis=axis))
    if parameters.occlusion.enabled and (expected is None or len(chosen) < expected):
        extra = parameters.occlusion.extra_sd_mrad
        rays = (
            left.rays(rig.left, extra),
            right.rays(rig.right, extra),
        )
        missing = None if expected is None else expected - len(chosen)
        others = _left_over(chosen, points, rays, rig, models, parameters, missing)
        sure = replace(chosen, log_odds=np.full(len(chosen), _CERTAIN))
        pool = TriadCandidates.joined([sure, others])
        chosen = pool.take(select_triads(pool, points, parameters.choose, expected=expected, axis=axis))
    triads = fit_poses(left, right, rig, chosen, models, parameters.measure)
    flags = (*_occlusion_flags(triads), *_pose_flags(triads), *_count_flags(triads, expected))
    return TriadSearch(triads, chosen, points, triplets, flags)


def ball_images(search: TriadSearch, left: Features, right: Features) -> tuple[Features, Features]:
    """Return the left and right features of the balls that both views show, one pair a ball."""
    i = np.concatenate([search.chosen.left.ravel(), search.chosen.right.ravel()]).reshape(2, -1)
    i = i[:, np.all(i != HIDDEN, axis=0)]
    return left.take(i[0]), right.take(i[1])


def _left_over(
    chosen: TriadCandidates,
    points: Points,
    rays: tuple[Rays, Rays],
    rig: Rig,
    models: Sequence[TriadModel],
    parameters: SearchParameters,
    missing: int | None,
) -> TriadCandidates:
    """Return triads that are not in full view, of features that the chosen ones do not use."""
    free = _unused(len(rays[0]), chosen.left), _unused(len(rays[1]), chosen.right)
    usable = np.isin(points.left_index, free[0]) & np.isin(points.right_index, free[1])
    found = occluded_candidates(
        points.take(usable), rays, free, rig, models, parameters.choose, parameters.occlusion, missing
    )
    best = np.argsort(-found.log_odds, kind="stable")[: parameters.choose.max_candidates]
    return found.take(best)


def _unused(count: int, used: Int) -> Int:
    return np.setdiff1d(np.arange(count), used)


def _occlusion_flags(triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    return tuple(
        Flag(
            "ball-occluded",
            f"triad {number} along the spine: ball {name} is not seen in the {' and '.join(ball.hidden_in)}"
            " view; its pose is less certain",
        )
        for number, triad in enumerate(triads, start=1)
        for name, ball in triad.balls.items()
        if triad.pose is not None and ball.hidden_in
    )


def _pose_flags(triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    return tuple(
        Flag("triad-incomplete", f"triad {number} along the spine has no pose: {triad.reason}")
        for number, triad in enumerate(triads, start=1)
        if triad.pose is None
    )


def _count_flags(triads: Sequence[MeasuredTriad], expected: int | None) -> tuple[Flag, ...]:
    found = sum(triad.pose is not None for triad in triads)
    if expected is None or found == expected:
        return ()
    detail = (
        f"{found} of {expected} triads were found; the others are hidden, or their balls were not detected"
    )
    return (Flag("triad-count-low", detail),)
