"""Whether the triads of a pair are those of another marker than the one that was given.

A marker with its lengths in another order or unit fits few balls, so that triads are missing or have hidden balls
although every ball is in view; where two lengths are nearly equal, the triads fit badly. The search is then repeated
with the markers that may have been meant.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import SpinewatchError
from spinewatch.flags import Flag
from spinewatch.marker_texts import other_markers
from spinewatch.markers import TriadModel
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.pose import MeasuredTriad
from spinewatch.triads.search import SearchParameters, full_view_chain, full_view_points


def marker_flags(  # noqa: PLR0913
    triads: Sequence[MeasuredTriad],
    pair: tuple[Features, Features],
    rig: Rig,
    search: SearchParameters,
    models: Sequence[TriadModel],
    parameters: DiagnosisParameters | None = None,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
    misfit: bool = False,
) -> tuple[Flag, ...]:
    """Return a flag if another marker explains the balls of a pair far better than the ones given.

    Parameters
    ----------
    triads
        Triads that were found with the markers given.
    pair
        Features of the left and the right image.
    rig
        The calibrated cameras.
    search
        Parameters of the search.
    models
        Markers given.
    parameters
        When a cause is named; the default ones if None.
    expected
        Number of triads placed; None if it is not known.
    axis
        Object axis along which the spine extends.
    misfit
        Whether the residuals of the triads are larger than usual: legs that differ little leave every ball in view.

    Returns
    -------
    tuple of Flag
        "marker-doubtful", or none. None is looked for when more than half of the triads are in full view and fit.
    """
    p = parameters or DiagnosisParameters()
    full = sum(
        triad.pose is not None and not any(ball.hidden_in for ball in triad.balls.values())
        for triad in triads
    )
    if 2 * full > max(len(triads), expected or 0) and not misfit:
        return ()
    others = [(text, other) for model in models for text, other in other_markers(model)]
    left, right = pair
    best = left.best(p.max_features), right.best(p.max_features)
    try:
        points = full_view_points(best, rig, models, search)
    except (SpinewatchError, np.linalg.LinAlgError):
        return ()
    chain = partial(full_view_chain, points, rig, parameters=search, expected=expected, axis=axis)

    given_triads, given_log_odds = chain(models=models)
    found = [(*chain(models=[other]), text) for text, other in others]
    if not found:
        return ()
    count, log_odds, text = max(found, key=lambda one: one[1])
    log_odds -= float(np.log(len(found)))
    lead = log_odds - max(given_log_odds, 0.0)
    if count < max(p.min_triads, full) or log_odds < p.min_log_odds or lead < p.min_lead:
        return ()
    detail = (
        f"{count} triads in full view fit the marker {text}, and {given_triads} fit"
        f" {' or '.join(model.name for model in models)}, the one given; name the marker, or give the lengths of its"
        " legs in mm and in the order XX,YY,MX (flat) or XX,YY,ZZ (orthogonal)"
    )
    return (Flag("marker-doubtful", detail),)
