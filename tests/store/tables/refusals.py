"""Statements that the database of the record refuses."""

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from store.database import Database


def refused(database: Database, statement: str) -> None:
    """Fail unless the database refuses a statement because it contradicts the record."""
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(text(statement))
