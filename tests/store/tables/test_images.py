import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE images SET content = 'other'",
        "DELETE FROM images",
        "INSERT INTO sent_images (sent_sha256, sha256, created_at) VALUES ('a', 'no image', '2026-11-28')",
    ],
)
def test_the_database_refuses_an_image_that_changes_or_goes_while_it_is_used(
    record: Database, statement: str
) -> None:
    refused(record, statement)
