"""Contract models of bursts from the library's results."""

import json

from contract.burst import Burst, BurstPair
from spinewatch.tracking.burst import Breathing, BurstParameters, BurstResult, Movement
from tests.contract.results import pose


def pair(offset_s: float | None) -> BurstPair:
    return BurstPair(offset_s=offset_s, view_delay_s=None, poses={}, outliers=[], labelled_by=None, flags=[])


def test_a_burst_has_its_breathing_and_the_outliers_of_each_pair() -> None:
    movements = {"L1": Movement(1.0, 0.1, None, None), "T9": Movement(2.0, 0.1, 1.5, 0.2)}
    result = BurstResult(
        poses={"L1": pose()},
        breathing=Breathing(4.0, 0.05, 1, movements),
        pairs_used={"L1": 2, "T9": 1},
        outliers=((), ("T9",)),
        shared_position_share=0.25,
        shared_rotation_share=0.125,
    )
    burst = Burst.of(result, [pair(0.0), pair(1.5)], "L1", BurstParameters())
    assert [one.outliers for one in burst.pairs] == [[], ["T9"]]
    assert burst.breathing is not None
    assert (burst.breathing.reference, burst.breathing.movements["L1"].relative_mm) == ("L1", None)
    assert burst.breathing.movements["T9"].relative_mm == 1.5
    assert burst.parameters["min_cycles"] == 1.0
    assert Burst.model_validate(json.loads(burst.model_dump_json())) == burst


def test_a_burst_without_breathing() -> None:
    result = BurstResult({}, None, {}, ((),), 0.0, 0.0)
    burst = Burst.of(result, [pair(None)], "L1", BurstParameters())
    assert burst.breathing is None
    assert (burst.shared_position_share, burst.shared_rotation_share) == (0.0, 0.0)
