import pytest
from sqlalchemy import inspect

from contract.pair_result import PairFeatures, PairResult
from store import measurements, pair_results, stages
from store.database import Database
from store.errors import NotFoundError
from store.measurements import MeasuredStage
from store.tables.measurements import PairResult as Row
from tests.store.builders import claimed, new_stage, new_surgery, stage_result, succeed


def some() -> PairFeatures:
    result = stage_result()
    return PairFeatures(features=result.features, fields=result.fields, exposure=result.exposure)


def measured(database: Database, *pairs: PairResult) -> tuple[str, str]:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)
    assert succeed(database, claimed(database, stage.job.id), result=MeasuredStage(stage_result(), pairs))
    return surgery, stage.id


def test_what_pairs_were_measured_from_is_stored_in_their_order(database: Database) -> None:
    _, stage_id = measured(database, PairResult(), PairResult(features=some()))
    with database.read() as session:
        assert pair_results.find(session, stage_id, 2) == PairResult(features=some())
        assert pair_results.find(session, stage_id, 3) is None
        assert pair_results.all_of(session, stage_id) == (PairResult(), PairResult(features=some()))
        row = session.get_one(Row, (stage_id, 1))
        assert "content" in inspect(row).unloaded


def test_features_of_the_first_pair_are_those_of_the_stage(database: Database) -> None:
    surgery, stage_id = measured(database)
    with database.read() as session:
        stage, result = measurements.get(session, surgery, "PRE")
        assert pair_results.features(session, stage, result, 1) == some()
        with pytest.raises(NotFoundError, match="pair"):
            pair_results.features(session, stage, result, 2)
        assert pair_results.all_of(session, stage_id) == ()
        assert stages.get(session, surgery, "PRE").id == stage_id
