"""Changes become events, whose actor has columns of its own; until now the action began with the actor's kind."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_ACTORS = ("http", "worker", "command")


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "events",
        _number(),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("action", sa.String(length=64), nullable=False),
        sa.Column("actor_kind", sa.String(length=16), nullable=False),
        sa.Column("actor_name", sa.String(length=128), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=True),
        sa.Column("subject_id", sa.String(length=36), nullable=False),
        sa.PrimaryKeyConstraint("seq", name=op.f("pk_events")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_events_surgery_id"), "events", ["surgery_id"])
    for kind in _ACTORS:
        op.execute(
            "INSERT INTO events (seq, at, action, actor_kind, actor_name, surgery_id, subject_id)"  # noqa: S608
            f" SELECT seq, at, substr(action, {len(kind) + 2}), '{kind}', '', surgery_id, subject_id FROM changes"
            f" WHERE action LIKE '{kind}:%' ORDER BY seq"
        )
    _continue_numbers("events")
    op.drop_table("changes")


def downgrade() -> None:
    """Take the change back; the names of the actors are lost."""
    op.create_table(
        "changes",
        _number(),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("action", sa.String(length=64), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=True),
        sa.Column("subject_id", sa.String(length=36), nullable=False),
        sa.PrimaryKeyConstraint("seq", name=op.f("pk_changes")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_changes_surgery_id"), "changes", ["surgery_id"])
    op.execute(
        "INSERT INTO changes (seq, at, action, surgery_id, subject_id)"
        " SELECT seq, at, actor_kind || ':' || action, surgery_id, subject_id FROM events ORDER BY seq"
    )
    _continue_numbers("changes")
    op.drop_table("events")


def _number() -> sa.Column[int]:
    return sa.Column("seq", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False)


def _continue_numbers(table: str) -> None:
    """Let PostgreSQL number new rows after the copied ones, as SQLite does by itself."""
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"SELECT setval(pg_get_serial_sequence('{table}', 'seq'), coalesce(max(seq), 1), max(seq) IS NOT NULL)"  # noqa: S608
            f" FROM {table}"
        )
