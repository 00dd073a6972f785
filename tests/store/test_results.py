from store import results
from store.database import Database
from tests.store.builders import claimed, new_stage, new_surgery, stage_result, succeed


def test_a_result_is_put_together_as_it_was_made(database: Database) -> None:
    result = stage_result(version="0.2.0")
    stage = new_stage(database, new_surgery(database))
    assert succeed(database, claimed(database, stage.job.id), result=result)
    with database.read() as session:
        assert results.whole(session, stage.id) == result
