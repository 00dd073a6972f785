"""Why MATCH-POINT found these triads: every triplet with its error and the heuristic that rejected it."""

from __future__ import annotations

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.rejections import TriadRejection
from spinewatch.thesis_1995.heuristics import TripletFeatures, h2_shared_point, h3_shared_feature
from spinewatch.thesis_1995.match_point import MatchPoint
from spinewatch.triads.explanation import Explanation, TriadVerdict, feature_uses
from spinewatch.triads.search import TriadSearch

_REJECTIONS = {
    "H1": TriadRejection.FEATURE_TWICE,
    "H2": TriadRejection.POINT_TAKEN,
    "H3": TriadRejection.FEATURE_TAKEN,
}


def explain_matching(
    found: MatchPoint,
    features: tuple[Features, Features],
    search: TriadSearch,
    model: TriadModel,
    method: str,
) -> Explanation:
    """Return what MATCH-POINT considered, and the heuristic that rejected each triplet.

    Parameters
    ----------
    found
        The steps of MATCH-POINT.
    features
        Features of the left and the right image.
    search
        Points and measured triads, in the order of those that passed.
    model
        The marker.
    method
        Name of the method.

    Returns
    -------
    Explanation
        Points, the most likely by their parallax first; triplets, those that passed along the spine first, then the
        rejected ones by their error. The rival of a triplet is the first triad that shares a point (H2) or a feature
        (H3) with it; None where that triplet was rejected itself.

    References
    ----------
    Thesis section 5.6, Tables 5.4 to 5.6.
    """
    chosen = [triad.triplet for triad in found.triads]
    rest = [k for k in np.argsort([t.error_mm for t in found.features], kind="stable") if k not in chosen]
    origins, _ = approximate_poses(model.coordinates_mm, found.points.position_mm[found.triplets])
    passed = [found.features[k] for k in chosen]
    verdicts = []
    for k in (*chosen, *rest):
        point, verdict = found.triplets[k], found.selection.verdicts[k]
        verdicts.append(
            TriadVerdict(
                model,
                found.left[point],
                found.right[point],
                origins[k],
                found.features[k].error_mm,
                None,
                _REJECTIONS.get(verdict),
                _rival(found.features[k], verdict, passed),
            )
        )
    order = np.argsort(-search.points.log_odds, kind="stable")
    uses = feature_uses(features, search.points, verdicts)
    return Explanation(search.points.take(order), tuple(verdicts), uses, search.triads, method)


def _rival(triplet: TripletFeatures, verdict: str, passed: list[TripletFeatures]) -> int | None:
    shares = {"H2": h2_shared_point, "H3": h3_shared_feature}.get(verdict)
    if shares is None:
        return None
    return next((place for place, other in enumerate(passed) if shares(triplet, other)), None)
