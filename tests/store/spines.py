"""Surgeries with a setup of the spine, and measured stages."""

from collections.abc import Sequence

from store import spine_setups
from store.database import Database
from tests.store.builders import (
    CLIENT,
    at,
    claimed,
    new_stage,
    new_surgery,
    spine_setup,
    stage_result,
    succeed,
    triad,
)


def configured(database: Database, second: float = 0.0, **changes: object) -> str:
    surgery = new_surgery(database)
    configure(database, surgery, second, **changes)
    return surgery


def configure(database: Database, surgery: str, second: float, **changes: object) -> None:
    with database.write() as session:
        spine_setups.put(session, surgery, spine_setup(**changes), at(second), CLIENT)


def measured(
    database: Database, surgery: str, name: str, second: float, labels: Sequence[str] = ("L1", "T11")
) -> str:
    stage = new_stage(database, surgery, name, now=at(second))
    end(database, stage.job.id, second, labels)
    return stage.id


def end(database: Database, job: str, second: float, labels: Sequence[str] = ("L1", "T11")) -> None:
    result = stage_result([triad(label) for label in labels])
    assert succeed(database, claimed(database, job, second), second, result)
