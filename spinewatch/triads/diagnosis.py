"""Why a stereo pair shows no triads: the change to images or rig with which its features become triads.

Each likely mistake is undone in turn: images exchanged, mirrored or turned, a camera rotated across the epipolar lines,
a base that is far off, markers outside the range that was given. The search for triads in full view is repeated, and
its chain has log-odds. A cause is named only if these are far above chance and far above those of every other cause.
Whether images without triads belong together at all follows from the number of features that meet (`meeting`), which
does not distinguish images of two stages from hidden markers with certainty. In a range that is far off, balls have
another size and are not detected: then only the ranges can be compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.markers import TriadModel, scaled
from spinewatch.matching.epipolar import EpipolarParameters, range_limits_mm
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.camera_motion import likeliest_rotations
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.meeting import meeting_sigma
from spinewatch.triads.search import SearchParameters, full_view_chain, full_view_points

Pair = tuple[Features, Features]

_MOVED, _SIZE = "moved", "size"
"""Causes for which the calibration is no longer that of the rig."""

_EXCHANGED = "exchanged"
"""Images exchanged, or both turned upside down, which is the same for a symmetric rig without distortion."""


@dataclass(frozen=True)
class Diagnosis:
    """The likeliest reason why triads are missing.

    Attributes
    ----------
    cause
        Name of the cause; ``hidden`` if the images belong together, ``hidden-or-unrelated`` if that is not certain.
    detail
        The cause in words.
    triads
        Number of triads in full view with the cause undone.
    log_odds
        Log-odds of their chain, less the logarithm of the number of trials.
    """

    cause: str
    detail: str
    triads: int
    log_odds: float

    @property
    def rig_has_moved(self) -> bool:
        """Whether the cause is a rig that is not the calibrated one."""
        return self.cause in (_MOVED, _SIZE)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A mistake undone: features, rig, markers and range with which the search is repeated."""

    cause: str
    detail: str
    pair: Pair
    rig: Rig
    models: Sequence[TriadModel]
    trials: int
    epipolar: EpipolarParameters


def diagnose(
    left: Features,
    right: Features,
    rig: Rig,
    search: SearchParameters,
    models: Sequence[TriadModel],
    parameters: DiagnosisParameters | None = None,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Diagnosis:
    """Return why the features of a stereo pair show no triads.

    Parameters
    ----------
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    search
        Parameters of the search.
    models
        Markers in use.
    parameters
        When a cause is named; the default ones if None.
    expected
        Number of triads placed; None if it is not known.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    Diagnosis
        The cause.

    References
    ----------
    Not in the thesis.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> rng, rig = np.random.default_rng(2), large_rig()
    >>> seen = observe(rig, random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=10))
    >>> diagnose(seen.right, seen.left, rig, SearchParameters(), [FLAT_10_14_18], expected=4).cause
    'exchanged'
    """
    p = parameters or DiagnosisParameters()
    if not len(left) or not len(right):
        return Diagnosis("no-features", "nothing in an image resembles a ball", 0, 0.0)
    pair = left.best(p.max_features), right.best(p.max_features)
    found = []
    for trial in _trials(pair, rig, search, models, p):
        triads, log_odds = _chain(trial, search, expected, axis)
        found.append(Diagnosis(trial.cause, trial.detail, triads, log_odds - float(np.log(trial.trials))))
    found.sort(key=lambda diagnosis: -diagnosis.log_odds)
    best = found[0]
    same = [
        other for other in found if other.cause == best.cause and best.log_odds - other.log_odds < p.min_lead
    ]
    others = [other.log_odds for other in found if other.cause != best.cause]
    certain = best.triads >= p.min_triads and best.log_odds >= p.min_log_odds
    if best.cause and certain and best.log_odds - max(others, default=0.0) >= p.min_lead:
        details = [other.detail for other in same] if best.cause == _EXCHANGED else [best.detail]
        return replace(best, detail=", or ".join(details))
    given = next(d for d in found if not d.cause)
    sigma = meeting_sigma(pair, rig, search.matching.epipolar, p)
    far_off = _far_range(rig, search.matching.epipolar)
    if (given.triads and given.log_odds >= p.min_log_odds) or sigma >= p.related_sigma:
        detail = "the images seem to belong together: balls are hidden or were not detected"
        return replace(given, cause="hidden", detail=detail + far_off)
    detail = (
        "the features of the two images do not meet: balls are hidden or were not detected, or the images are not of"
        " the same moment, or not of this rig"
    )
    return replace(given, cause="hidden-or-unrelated", detail=detail + far_off)


def _far_range(rig: Rig, epipolar: EpipolarParameters) -> str:
    """Return a remark on a range that was given and lies elsewhere than the optical axes meet; empty without one."""
    if epipolar.range_mm is None:
        return ""
    try:
        usual = np.mean(range_limits_mm(rig, replace(epipolar, range_mm=None)), axis=0)
    except ParameterError:
        return ""
    near, far = epipolar.range_mm
    if usual[0] <= (near + far) / 2 <= usual[1]:
        return ""
    return (
        f"; or the range of {near:g} to {far:g} mm that was given is not that of the markers: the optical axes meet at"
        f" about {usual[0]:.0f} to {usual[1]:.0f} mm"
    )


def _trials(
    pair: Pair, rig: Rig, search: SearchParameters, models: Sequence[TriadModel], p: DiagnosisParameters
) -> Iterator[_Trial]:
    """Yield the pair as given, without a cause, and with every mistake undone."""
    given = search.matching.epipolar
    yield _Trial("", "", pair, rig, models, 1, given)
    exchanged = "left and right are exchanged"
    yield _Trial(_EXCHANGED, exchanged, pair[::-1], rig, models, p.exchange_trials, given)
    if given.range_mm is not None:
        near, far = given.range_mm
        detail = (
            f"the markers lie outside of the range of {near:g} to {far:g} mm that was given; give the range in which"
            " they are along the optical axes, or none"
        )
        yield _Trial("range", detail, pair, rig, models, 1, replace(given, range_mm=None))
    for how, mirror in (("mirrored", (True, False)), ("turned upside down", (True, True))):
        for which, changed in (
            ("both images are", (0, 1)),
            ("the left image is", (0,)),
            ("the right image is", (1,)),
        ):
            undone = [
                _flipped(f, c.image_size_px, mirror) if k in changed else f
                for k, (f, c) in enumerate(zip(pair, (rig.left, rig.right), strict=True))
            ]
            detail = f"{which} {how}"
            cause = _EXCHANGED if all(mirror) and len(changed) == 2 else detail
            yield _Trial(cause, detail, (undone[0], undone[1]), rig, models, p.mirror_trials, given)
    for size in p.sizes:
        detail = f"markers come out {100 * (size - 1):+.0f}% in size: baseline, vergence or marker are not those given"
        trials = p.exchange_trials * len(p.sizes)
        yield _Trial(_SIZE, detail, pair, rig, [scaled(m, size) for m in models], trials, given)
    for turn, roll in likeliest_rotations(pair, rig, search, models, p):
        right = rig.right.moved(np.array([turn, 0.0, roll]), np.zeros(3))
        detail = (
            "a camera has moved across the epipolar lines: if it was the right one, by about"
            f" {np.degrees(turn):.2f} degrees about its x axis and {np.degrees(roll):.2f} about its optical axis;"
            " calibrate again"
        )
        yield _Trial(_MOVED, detail, pair, Rig(rig.name, rig.left, right), models, p.offset_trials, given)


def _chain(
    trial: _Trial, search: SearchParameters, expected: int | None, axis: SpineAxis
) -> tuple[int, float]:
    """Return the number of triads in full view of the best chain, and its log-odds."""
    matching = replace(search.matching, epipolar=trial.epipolar)
    try:
        points = full_view_points(trial.pair, trial.rig, trial.models, replace(search, matching=matching))
    except (SpinewatchError, np.linalg.LinAlgError):
        return 0, 0.0
    return full_view_chain(points, trial.rig, trial.models, search, expected=expected, axis=axis)


def _flipped(features: Features, size_px: tuple[int, int], axes: tuple[bool, bool]) -> Features:
    """Return features of an image that is mirrored along u, v or both."""
    sign = np.where(axes, -1.0, 1.0)
    xy = np.where(axes, np.array(size_px) - 1 - features.xy_px, features.xy_px)
    return replace(features, xy_px=xy, covariance_px2=features.covariance_px2 * np.outer(sign, sign))
