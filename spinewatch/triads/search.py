"""The search for triads: from the features of a stereo pair to measured triads, MATCH-POINT in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Int, Pixels
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.flags import Flag
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.exclusion import RemovedTriad, removed_candidates
from spinewatch.matching.identification import IdentificationParameters, Triplets, identify_triads
from spinewatch.matching.points import MatchingParameters, Points, match_features
from spinewatch.matching.rating import likeliest_points, rate_candidates
from spinewatch.matching.scale_measurement import MarkerBalls
from spinewatch.matching.selection import chain_log_odds, select_triads, surplus_triads
from spinewatch.matching.selection_parameters import SelectionParameters, SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.triads.doubt import DoubtParameters, triad_evidence, without_doubtful_poses
from spinewatch.triads.flags import triad_flags
from spinewatch.triads.occlusion import FreeFeatures, OcclusionParameters, occluded_candidates
from spinewatch.triads.pose import MeasuredTriad
from spinewatch.triads.pose_fit import PoseParameters, fit_poses


@dataclass(frozen=True)
class SearchParameters:
    """Parameters of the search, one set per step.

    Attributes
    ----------
    matching
        From features to points.
    identification
        From points to tuples that fit a marker.
    selection
        From tuples to the chain of triads.
    occlusion
        Triads with a hidden ball.
    pose
        Poses of the selected triads.
    doubt
        Chance that a triad is false, and its limit.
    max_points
        Number of points that are used, the most likely first. Sharp images have 200 to 700; in strongly blurred ones,
        whose deviations are large, thousands of points make a million chance tuples and no triad more.
    """

    matching: MatchingParameters = field(default_factory=MatchingParameters)
    identification: IdentificationParameters = field(default_factory=IdentificationParameters)
    selection: SelectionParameters = field(default_factory=SelectionParameters)
    occlusion: OcclusionParameters = field(default_factory=OcclusionParameters)
    pose: PoseParameters = field(default_factory=PoseParameters)
    doubt: DoubtParameters = field(default_factory=DoubtParameters)
    max_points: int = 1000


@dataclass(frozen=True, eq=False)
class TriadSearch:
    """The triads of a stereo pair, with the intermediate results that led to them.

    Attributes
    ----------
    triads
        Measured triads in order along the spine axis.
    selected
        Their features, approximate poses and log-odds, in the same order.
    points
        All triangulated points.
    triplets
        Tuples of points that fit each marker.
    flags
        Doubts about the result.
    occluded
        Candidate triads with a hidden ball that were considered.
    """

    triads: tuple[MeasuredTriad, ...]
    selected: TriadCandidates
    points: Points
    triplets: tuple[Triplets, ...]
    flags: tuple[Flag, ...]
    occluded: TriadCandidates = field(default_factory=TriadCandidates.empty)


def match_triads(  # noqa: PLR0913
    left: Features,
    right: Features,
    rig: Rig,
    parameters: SearchParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
    images: tuple[Pixels, Pixels] | None = None,
    models: Sequence[TriadModel] = (FLAT_10_14_18,),
    removed: Sequence[RemovedTriad] = (),
) -> TriadSearch:
    """Return the triads that the features of a stereo pair show.

    Triads in full view are selected first. If some are missing, or their number is not known, triads with a hidden ball
    are searched for among the remaining features. Doubtful triads are never added to reach the expected number.

    Parameters
    ----------
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    parameters
        Parameters of the steps.
    expected
        Number of triads placed; None if it is not known. It is exceeded only by triads in full view that are beyond
        doubt.
    axis
        Object axis along which the spine extends.
    images
        Left and right gray image, shape (H, W), for structural refinement only.
    models
        Markers in use.
    removed
        Triads that a person removed, which are not found again.

    Returns
    -------
    TriadSearch
        The triads, flagged "ball-occluded" where a ball is hidden, "ball-manual" where a person placed the centre of
        one, "triad-incomplete" without a pose, "triad-doubtful" without one because the triad may be false,
        "triad-count-low" if there are fewer than expected (H5), "triad-count-high" if there are more.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis chapter 5.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> rng, rig = np.random.default_rng(1), large_rig()
    >>> observed = observe(rig, random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=20))
    >>> search = match_triads(observed.left, observed.right, rig, SearchParameters(), expected=4)
    >>> len(search.triads), search.flags
    (4, ())
    """
    p = parameters
    points = full_view_points((left, right), rig, models, p, images)
    triplets = tuple(identify_triads(points, model, p.identification) for model in models)
    candidates = rate_candidates(triplets, points, models, rig, p.selection, expected)
    candidates = candidates.take(~removed_candidates(candidates, left, right, removed))
    occluded = TriadCandidates.empty()
    members = select_triads(candidates, points, p.selection, expected=expected, axis=axis)
    if len(members) == expected:
        members = surplus_triads(candidates, points, members, p.selection, axis=axis)
    selected = candidates.take(members)
    if p.occlusion.enabled and (expected is None or len(selected) < expected):
        features = _free_features(left, right, rig, points, selected, p.occlusion.extra_sd_mrad)
        missing = None if expected is None else expected - len(selected)
        occluded = occluded_candidates(
            features, rig, models, p.identification, p.selection, p.occlusion, missing
        )
        best = np.argsort(-occluded.log_odds, kind="stable")[: p.selection.max_candidates]
        occluded = occluded.take(best)
        occluded = occluded.take(~removed_candidates(occluded, left, right, removed))
        certain = replace(selected, log_odds=np.full(len(selected), p.occlusion.selected_log_odds))
        candidates = TriadCandidates.concatenate([certain, occluded])
        members = select_triads(candidates, points, p.selection, expected=expected, axis=axis)
        selected = TriadCandidates.concatenate([selected, occluded]).take(members)
    triads = fit_poses(left, right, rig, selected, models, p.pose)
    if triads and left.visible is not None and right.visible is not None:
        evidence = triad_evidence(triads, selected, (left, right), points, rig, models, p.selection, axis)
        triads = without_doubtful_poses(triads, evidence.chances(p.doubt).tolist(), p.doubt.max_chance)
    return TriadSearch(triads, selected, points, triplets, triad_flags(triads, expected), occluded)


def full_view_points(
    pair: tuple[Features, Features],
    rig: Rig,
    models: Sequence[TriadModel],
    parameters: SearchParameters,
    images: tuple[Pixels, Pixels] | None = None,
) -> Points:
    """Return the points of a stereo pair in which triads are sought.

    Parameters
    ----------
    pair
        Features of the left and the right image.
    rig
        The calibrated cameras.
    models
        Markers in use.
    parameters
        Parameters of the steps.
    images
        Left and right gray image, shape (H, W), for structural refinement only.

    Returns
    -------
    Points
        The likeliest points, object space.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.
    """
    ball_diameter = max(model.ball_diameter_mm for model in models)
    points = match_features(*pair, rig, ball_diameter, parameters.matching, images)
    return likeliest_points(points, parameters.selection, parameters.max_points)


def full_view_chain(
    points: Points,
    rig: Rig,
    models: Sequence[TriadModel],
    parameters: SearchParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> tuple[int, float]:
    """Return the number of triads in full view of the best chain, and its log-odds.

    Parameters
    ----------
    points
        Points of `full_view_points`.
    rig
        The calibrated cameras.
    models
        Markers that are tried.
    parameters
        Parameters of the steps.
    expected
        Number of triads placed; None if it is not known.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    count : int
        Number of triads.
    log_odds : float
        Log-odds of their chain against one by chance.
    """
    triplets = [identify_triads(points, model, parameters.identification) for model in models]
    candidates = rate_candidates(triplets, points, models, rig, parameters.selection, expected)
    return chain_log_odds(candidates, points, parameters.selection, expected=expected, axis=axis)


def ball_images(search: TriadSearch, left: Features, right: Features) -> tuple[Features, Features]:
    """Return the features of the balls that both images show.

    Parameters
    ----------
    search
        Result of the search.
    left, right
        The features that were searched.

    Returns
    -------
    left, right : Features
        One left and one right feature per ball of the triads that are not doubtful, in the same order.
    """
    selected = _certain(search)
    i = np.concatenate([selected.left.ravel(), selected.right.ravel()]).reshape(2, -1)
    i = i[:, np.all(i != HIDDEN, axis=0)]
    return left.take(i[0]), right.take(i[1])


def marker_balls(search: TriadSearch, models: Sequence[TriadModel]) -> MarkerBalls:
    """Return the markers of the balls that both images show.

    Parameters
    ----------
    search
        Result of the search.
    models
        Markers in use, as in the search.

    Returns
    -------
    MarkerBalls
        Markers of the balls in the order of `ball_images`, with the distances of triads in full view.
    """
    selected = _certain(search)
    in_both = (selected.left != HIDDEN) & (selected.right != HIDDEN)
    number = np.cumsum(in_both).reshape(in_both.shape) - 1
    used = [models[index] for index in selected.model]
    full = [t for t, model in enumerate(used) if in_both[t, : len(model.balls)].all()]
    return MarkerBalls(
        np.nonzero(in_both)[0],
        np.concatenate([np.empty((0, 2), dtype=np.intp), *(number[t][used[t].pairs] for t in full)]),
        np.concatenate([np.empty(0), *(used[t].distances_mm for t in full)]),
    )


def _certain(search: TriadSearch) -> TriadCandidates:
    """Return the selected triads that are not doubtful."""
    return search.selected.take(np.flatnonzero([not triad.doubtful for triad in search.triads]))


def _free_features(
    left: Features,
    right: Features,
    rig: Rig,
    points: Points,
    selected: TriadCandidates,
    extra_sd_mrad: float,
) -> FreeFeatures:
    """Return the features that the selected triads do not use."""
    rays = left.rays(rig.left, extra_sd_mrad), right.rays(rig.right, extra_sd_mrad)
    free = _unused(len(left), selected.left), _unused(len(right), selected.right)
    usable = np.isin(points.left_index, free[0]) & np.isin(points.right_index, free[1])
    return FreeFeatures(points.take(usable), rays, free)


def _unused(count: int, used: Int) -> Int:
    """Return the indices below ``count`` that are not used."""
    return np.setdiff1d(np.arange(count), used)
