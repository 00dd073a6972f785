"""Setups of the spine, and the spine of each stage."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "spine_setups",
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("created_at", _TIME, nullable=False),
        _foreign_key("spine_setups", "surgery_id", "surgeries", "id"),
        sa.PrimaryKeyConstraint("surgery_id", "revision", name=op.f("pk_spine_setups")),
    )
    op.create_table(
        "spine_rebaselines",
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("vertebra", sa.String(length=16), nullable=False),
        sa.Column("before", sa.String(length=64), nullable=False),
        sa.Column("after", sa.String(length=64), nullable=False),
        sa.Column("created_at", _TIME, nullable=False),
        _foreign_key("spine_rebaselines", "surgery_id", "surgeries", "id"),
        sa.PrimaryKeyConstraint("surgery_id", "position", name=op.f("pk_spine_rebaselines")),
    )
    op.create_table(
        "spines",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("setup_revision", sa.Integer(), nullable=False),
        sa.Column("fingerprint", sa.String(length=64), nullable=False),
        sa.Column("document", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("version", sa.String(length=32), nullable=False),
        sa.Column("created_at", _TIME, nullable=False),
        _foreign_key("spines", "surgery_id", "surgeries", "id"),
        _foreign_key("spines", "stage_id", "measurements", "stage_id"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_spines")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_spines_surgery_id_stage_id"), "spines", ["surgery_id", "stage_id"])


def downgrade() -> None:
    """Take the change back; setups and spines are lost, and so are the jobs that compute spines."""
    op.drop_table("spines")
    op.drop_table("spine_rebaselines")
    op.drop_table("spine_setups")
    op.execute("DELETE FROM jobs WHERE kind = 'spine'")


def _foreign_key(table: str, column: str, parent: str, key: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint([column], [f"{parent}.{key}"], name=op.f(f"fk_{table}_{column}_{parent}"))
