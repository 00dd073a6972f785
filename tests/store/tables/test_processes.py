from store import processes
from store.database import Database
from store.processes import ProcessKind
from tests.store.tables.refusals import refused


def test_the_database_refuses_a_process_that_is_there(database: Database) -> None:
    with database.write() as session:
        processes.report(session, "the-process", ProcessKind.WORKER, "cart:17")
    refused(database, "INSERT INTO processes SELECT * FROM processes")
