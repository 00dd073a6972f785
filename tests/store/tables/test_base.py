"""What all tables promise to queries; that migrations make them is tested in tests/migrations."""

import subprocess
import sys

import pytest

from store.tables.base import Base


def test_relationships_load_only_when_asked() -> None:
    lazy = {
        f"{mapper.class_.__name__}.{relationship.key}": relationship.lazy
        for mapper in Base.registry.mappers
        for relationship in mapper.relationships
    }
    assert set(lazy.values()) == {"raise"}


def test_every_constraint_has_a_name() -> None:
    assert all(constraint.name for table in Base.metadata.tables.values() for constraint in table.constraints)


@pytest.mark.parametrize("module", ["base", "jobs", "stages"])
def test_the_tables_that_one_refers_to_are_known_whichever_is_imported(module: str) -> None:
    program = (
        f"import store.tables.{module}; from sqlalchemy.orm import configure_mappers; configure_mappers()"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
