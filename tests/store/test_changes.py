from contract.change import Changes
from contract.event import Outcome
from contract.key import NewKey, Scope
from store import changes, events, jobs, keys, retention
from store.database import Database
from store.events import Action
from tests.store.builders import CLIENT, NOON, claimed, new_stage, new_surgery, succeed


def listed(database: Database, since: int = 0, limit: int = 100, surgery: str | None = None) -> Changes:
    with database.read() as session:
        return changes.listed(session, since, limit, surgery)


def test_changes_are_in_order_and_name_the_stage(database: Database) -> None:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)
    assert succeed(database, claimed(database, stage.job.id))
    found = listed(database, surgery=surgery)
    assert [(change.action, change.stage, change.take) for change in found.changes] == [
        ("surgery:created", None, None),
        ("stage:submitted", "PRE", 1),
        ("job:started", None, None),
        ("stage:measured", "PRE", 1),
    ]
    assert [change.kind for change in found.changes] == ["surgery", "stage", "job", "stage"]
    assert found.done
    assert found.last == found.changes[-1].seq


def test_pages_go_on_after_the_last_change(database: Database) -> None:
    ids = [new_surgery(database) for _ in range(5)]
    found, position, done = [], 0, False
    while not done:
        page = listed(database, position, 2)
        found += [change.id for change in page.changes]
        position, done = page.last, page.done
    assert found == ids
    assert listed(database, position).changes == []


def test_access_and_refusals_are_left_out_and_passed_over(database: Database) -> None:
    new_surgery(database)
    with database.write() as session:
        keys.add(session, NewKey(name="cart", scopes=[Scope.CAPTURE_WRITE]), NOON, CLIENT)
        events.append(session, NOON, CLIENT, Action.STAGE_SUBMITTED, "x", outcome=Outcome.REFUSED)
    found = listed(database)
    assert [change.action for change in found.changes] == ["surgery:created"]
    with database.read() as session:
        assert found.last == changes.last_number(session) > found.changes[-1].seq


def test_a_glance_has_the_jobs_that_have_ended(database: Database) -> None:
    surgery = new_surgery(database)
    first, second = (new_stage(database, surgery, name).job.id for name in ("PRE", "POST"))
    with database.write() as session:
        jobs.cancel(session, first, NOON, CLIENT)
    with database.read() as session:
        seen = changes.glance(session, [first, second])
        assert seen.ended == {first}
        assert changes.glance(session, []) == changes.Glance(seen.last, frozenset())


def test_what_happens_to_keys_and_sessions_is_known_to_have_happened(database: Database) -> None:
    def since(number: int) -> bool:
        with database.read() as session:
            return changes.of_access(session, number)

    with database.write() as session:
        key, _ = keys.add(session, NewKey(name="cart", scopes=[Scope.CAPTURE_WRITE]), NOON, CLIENT)
    assert since(0)
    new_stage(database, new_surgery(database))
    with database.read() as session:
        last = changes.last_number(session)
    assert since(0)
    assert not since(1)
    with database.write() as session:
        keys.revoke(session, key.prefix, NOON, CLIENT)
    assert since(last)


def test_of_a_deleted_surgery_only_its_deletion_is_told(database: Database) -> None:
    kept, deleted = new_surgery(database), new_surgery(database)
    new_stage(database, deleted)
    with database.write() as session:
        retention.delete(session, deleted, None, NOON, CLIENT)
    named = (change for change in listed(database).changes if change.surgery_id is not None)
    found = [(change.surgery_id, change.action) for change in named]
    assert found == [(kept, "surgery:created"), (deleted, "surgery:deleted")]
    assert [change.action for change in listed(database, surgery=deleted).changes] == ["surgery:deleted"]
