from dataclasses import replace

import numpy as np

from contract.explanation import MAX_POINTS, MAX_TRIADS, Explanation
from spinewatch.detection.features import HIDDEN, DiscardedCandidates
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.points import Points
from spinewatch.matching.rejections import FeatureRejection, TriadRejection
from spinewatch.stage import StageMeasurement
from spinewatch.triads import explanation
from spinewatch.triads.explanation import FeatureUse, TriadVerdict
from tests.contract.results import measurement

INDEX = np.array([0, 1, 2])


def verdict(
    reason: TriadRejection | None, log_odds: float | None = 9.0, rival: int | None = None
) -> TriadVerdict:
    hidden = np.array([0, 1, HIDDEN])
    return TriadVerdict(FLAT_10_14_18, INDEX, hidden, np.ones(3) / 3, 0.25, log_odds, reason, rival)


def explained(points: int = 1, *further: TriadVerdict) -> StageMeasurement:
    given = measurement()
    n = points
    table = Points(np.zeros((n, 3)), np.zeros((n, 3, 3)), np.arange(n), np.arange(n), *4 * [np.zeros(n)])
    triads = tuple(triad.triad for triad in reversed(given.triads))
    uses = (FeatureUse(0, "XX", None),), (FeatureUse(None, None, FeatureRejection.NO_PARTNER),)
    verdicts = (verdict(None), verdict(None), *further)
    discarded = DiscardedCandidates(
        np.array([[1.5, 2], [3, 4]]), np.array([0.3, 0.2]), np.array([True, False]), np.array([0, HIDDEN])
    )
    left = replace(given.left, discarded=discarded)
    return replace(given, left=left, explanation=explanation.Explanation(table, verdicts, uses, triads))


def of(given: StageMeasurement) -> Explanation:
    found = Explanation.of(given)
    assert found is not None
    return Explanation.model_validate_json(found.model_dump_json())


def test_chosen_triads_have_their_place_in_the_result() -> None:
    document = of(
        explained(1, verdict(TriadRejection.POINT_TAKEN, 3.0, 1), verdict(TriadRejection.DISTANCES, None))
    )
    assert [triad.triad for triad in document.triads] == [1, 0, None, None]
    assert [triad.heuristic for triad in document.triads] == [None, None, "H2", None]
    assert [triad.rival for triad in document.triads] == [None, None, 1, None]
    assert document.triads[3].log_odds is None
    assert (document.triads[0].left, document.triads[0].right) == ([0, 1, 2], [0, 1, None])
    assert document.triads[0].position_mm == [0.3333, 0.3333, 0.3333]
    assert (document.left.features[0].ball, document.right.features[0].reason) == ("XX", "no-partner")
    assert [(one.reason, one.feature) for one in document.left.discarded] == [
        ("same-ball", 0),
        ("low-score", None),
    ]


def test_what_is_left_out_is_counted() -> None:
    many = [verdict(TriadRejection.IMPROBABLE)] * MAX_TRIADS
    document = of(explained(MAX_POINTS + 3, *many))
    assert (len(document.points), document.points_left_out) == (MAX_POINTS, 3)
    assert (len(document.triads), document.triads_left_out) == (MAX_TRIADS, 2)


def test_a_triad_that_was_removed_later_says_so() -> None:
    document = of(explained()).placed({0: 5})
    assert [(triad.triad, triad.reason) for triad in document.triads] == [(None, "removed"), (5, None)]
    gone = of(replace(explained(), triads=()))
    assert [triad.reason for triad in gone.triads] == ["removed", "removed"]
    assert of(explained()).placed({0: 1, 1: None}).triads[0].reason is None


def test_without_an_explanation_there_is_none() -> None:
    assert Explanation.of(measurement()) is None
