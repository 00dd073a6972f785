"""Stages have a number and a place, so that their order depends neither on a clock nor on later takes of a name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

_COLUMNS = ("number", "place")
_INDEX = "ix_stages_surgery_id_place_take"
_TAKES = """
SELECT id, surgery_id, name, take, revised_take FROM stages
LEFT JOIN (SELECT subject_id, min(seq) AS seq FROM events WHERE action = 'stage:submitted' GROUP BY subject_id) AS sent
ON sent.subject_id = stages.id
ORDER BY surgery_id, revised_take IS NOT NULL, coalesce(seq, 0), created_at, take, id
"""
"""Takes with images of their own in the order of their events, those from before there were events first."""

_TRIGGERS = "SELECT name, sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'stages'"


def upgrade() -> None:
    """Make the change."""
    for name in _COLUMNS:  # one by one: a table that is made anew would lose its triggers
        op.add_column("stages", sa.Column(name, sa.Integer(), server_default=sa.text("0"), nullable=False))
    changes = list(_numbered())
    if changes:
        with _without_triggers():
            op.get_bind().execute(
                sa.text("UPDATE stages SET number = :number, place = :place WHERE id = :id"), changes
            )
    op.create_index(op.f(_INDEX), "stages", ["surgery_id", "place", "take"], unique=True)


def downgrade() -> None:
    """Take the change back; stages are in the order of their times again."""
    op.drop_index(op.f(_INDEX), "stages")
    for name in reversed(_COLUMNS):
        op.drop_column("stages", name)


def _numbered() -> Iterator[dict[str, str | int]]:
    """Yield number and place of each take."""
    numbers: dict[tuple[str, str, int], int] = {}
    places: dict[tuple[str, str], int] = {}
    last: dict[str, int] = {}
    revisions = []
    for take in op.get_bind().execute(sa.text(_TAKES)):
        key = (take.surgery_id, take.name, take.take)
        if take.revised_take is not None:
            revisions.append(take)
            continue
        number = last[take.surgery_id] = last.get(take.surgery_id, 0) + 1
        numbers[key] = number
        place = places.setdefault(key[:2], number)
        yield {"id": take.id, "number": number, "place": place}
    for take in sorted(revisions, key=lambda row: row.take):
        stage = (take.surgery_id, take.name)
        number = numbers[(*stage, take.take)] = numbers[(*stage, take.revised_take)]
        yield {"id": take.id, "number": number, "place": places[stage]}


@contextmanager
def _without_triggers() -> Iterator[None]:
    """Let stages be changed."""
    connection = op.get_bind()
    if connection.dialect.name != "sqlite":
        op.execute("ALTER TABLE stages DISABLE TRIGGER USER")
        yield
        op.execute("ALTER TABLE stages ENABLE TRIGGER USER")
        return
    triggers = connection.execute(sa.text(_TRIGGERS)).all()
    for name, _ in triggers:
        op.execute(f"DROP TRIGGER {name}")
    yield
    for _, statement in triggers:
        connection.exec_driver_sql(statement)
