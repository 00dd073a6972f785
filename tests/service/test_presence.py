from collections.abc import Iterator
from pathlib import Path

import pytest

from service.presence import deletion, surgery_of
from store import retention
from store.database import Database
from tests.backends import new_database
from tests.store.builders import CLIENT, NOON, new_surgery


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


@pytest.mark.parametrize(
    ("template", "path", "surgery"),
    [
        ("/v1/surgeries/{surgery_id}", "/v1/surgeries/a", "a"),
        ("/v1/surgeries/{surgery_id}/stages/{name}", "/v1/surgeries/a/stages/b", "a"),
        ("/v1/surgeries", "/v1/surgeries", None),
        ("/v1/jobs/{job_id}", "/v1/jobs/a", None),
        (None, "/v1/surgeries/a", None),
        ("/v1/surgeries/{surgery_id}", "/v1/surgeries/\x00", None),
        ("/v1/surgeries/{surgery_id}", "/v1/surgeries/a\n", None),
    ],
)
def test_the_surgery_is_that_of_the_path(template: str | None, path: str, surgery: str | None) -> None:
    assert surgery_of(template, path) == surgery


def test_a_surgery_is_gone_once_it_was_deleted(database: Database) -> None:
    surgery = new_surgery(database)
    with database.write() as session:
        assert deletion(session, surgery) is None
        retention.delete(session, surgery, None, NOON, CLIENT)
    with database.read() as session:
        error = deletion(session, surgery)
        assert deletion(session, "none") is None
    assert error is not None
    assert error.code == "surgery-deleted"
