from sqlalchemy import text

from store import processes
from store.database import Database
from store.processes import ProcessKind
from workers.presence import Presence


def names(database: Database) -> list[str]:
    with database.read() as session:
        return [process.name for process in processes.alive(session, ProcessKind.WORKER)]


def test_a_worker_is_present_from_its_report_to_its_end(database: Database) -> None:
    first, second = Presence(database, "cart:1"), Presence(database, "cart:1")
    assert names(database) == []
    first.report()
    first.report()
    second.report()
    assert names(database) == ["cart:1", "cart:1"]
    first.end()
    assert names(database) == ["cart:1"]


def test_an_end_that_cannot_be_reported_stops_nothing(database: Database) -> None:
    presence = Presence(database, "cart:1")
    presence.report()
    with database.write() as session:
        session.execute(text("DROP TABLE processes"))
    presence.end()
