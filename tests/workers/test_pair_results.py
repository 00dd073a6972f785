from dataclasses import replace
from typing import Any

from contract.stage import StageResult
from tests.contract.results import labelled, measurement
from tests.contract.test_explanation import explained
from tests.store.builders import stage_result, triad
from workers.pair_results import pair_results


def test_a_single_pair_has_an_explanation_and_no_features_of_its_own() -> None:
    given = explained()
    (pair,) = pair_results([given], StageResult.of(given, "0"))
    assert pair.features is None
    assert pair.explanation is not None
    assert [one.triad for one in pair.explanation.triads] == [1, 0]


def test_pairs_of_a_burst_name_its_triads_by_label() -> None:
    first, second = explained(), explained()
    empty: dict[str, Any] = {
        "pairs": [],
        "breathing": None,
        "pairs_used": {},
        "shared_position_share": 0.0,
        "shared_rotation_share": 0.0,
        "parameters": {},
    }
    result = stage_result([triad("T11"), triad("L1"), triad(None)], burst=empty)
    found = pair_results([first, second], result)
    places = [[one.triad for one in pair.explanation.triads] for pair in found if pair.explanation]
    assert places == [[2, 1], [None, 1]]
    assert found[0].features is None
    assert found[1].features is not None
    assert found[1].features.fields.left == [1, 2, 3, 4]


def test_without_an_explanation_there_is_none() -> None:
    plain = replace(measurement(), triads=(labelled(),))
    assert pair_results([plain], StageResult.of(plain, "0"))[0].explanation is None
