"""The rows of a measured stage, and that what is read from them is what was measured."""

import json
import pickle

from contract.pair_result import PairResult
from store import measurements, pair_results, results
from store.database import Database
from store.packed_stage import pack
from tests.store.builders import WORKER, at, new_stage, new_surgery, stage_result


def test_rows_have_every_part_of_the_result_once() -> None:
    result = stage_result()
    rows = pack(result, [PairResult()])
    whole = result.model_dump(mode="json")
    assert set(rows.result) == set(whole) - {"features", "triads", "burst"}
    assert {side: json.loads(points) for side, _, points, _ in rows.features} == whole["features"]
    assert [count for _, count, _, _ in rows.features] == [
        len(points) for points in whole["features"].values()
    ]
    assert [json.loads(triad) for _, triad in rows.triads] == whole["triads"]
    assert [label for label, _ in rows.triads] == [triad.label for triad in result.triads]
    assert rows.burst is None


def test_rows_travel_and_are_read_as_what_was_measured(database: Database) -> None:
    result, pair = stage_result(), PairResult()
    stage = new_stage(database, new_surgery(database))
    rows = pickle.loads(pickle.dumps(pack(result, [pair])))  # noqa: S301 - our own
    with database.write() as session:
        measurements.add(session, stage.id, rows, at(1), WORKER)
    with database.read() as session:
        assert results.whole(session, stage.id) == result
        assert pair_results.all_of(session, stage.id) == (pair,)
