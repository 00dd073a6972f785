import numpy as np

from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.points import Points
from spinewatch.matching.rejections import FeatureRejection, TriadRejection
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.thesis_1995.explanation import explain_matching
from spinewatch.triads.explanation import Explanation
from spinewatch.triads.search import TriadSearch
from tests.spinewatch.thesis_1995.matched import ORIGINS_MM, features, matched


def explained() -> Explanation:
    found = matched()
    k = len(found.left)
    points = Points(
        found.points.position_mm,
        found.points.covariance_mm2,
        found.left,
        found.right,
        found.points.parallax_mm,
        found.points.chi2,
        -found.points.chi2,
        np.ones(k),
    )
    search = TriadSearch((), TriadCandidates.empty(), points, (), ())
    return explain_matching(found, features(), search, FLAT_10_14_18, "thesis-1995")


def test_triads_that_passed_come_first_along_the_spine() -> None:
    found = explained()
    assert found.method == "thesis-1995"
    passed = [verdict for verdict in found.verdicts if verdict.reason is None]
    assert found.verdicts[:2] == tuple(passed)
    assert [verdict.left.tolist() for verdict in passed] == [[0, 1, 2], [3, 4, 5]]
    for verdict, origin in zip(passed, ORIGINS_MM, strict=True):
        np.testing.assert_allclose(verdict.position_mm, origin, atol=0.1)


def test_the_others_have_their_error_heuristic_and_rival() -> None:
    rejected = [verdict for verdict in explained().verdicts if verdict.reason is not None]
    assert rejected
    assert [verdict.error_mm for verdict in rejected] == sorted(verdict.error_mm for verdict in rejected)
    shadow = next(verdict for verdict in rejected if verdict.left.tolist() == [6, 1, 2])
    assert (shadow.reason, shadow.rival) == (TriadRejection.POINT_TAKEN, 0)


def test_features_have_their_ball_or_why_they_have_none() -> None:
    left, right = explained().uses
    assert [use.ball for use in left[:6]] == ["XX", "YY", "MX"] * 2
    assert left[6].reason == right[6].reason == FeatureRejection.REJECTED
