"""Processes of the service and when each reported last, and the time that the steps of jobs took."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

_TIME = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "processes",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("kind", sa.String(length=16), nullable=False),
        sa.Column("name", sa.String(length=128), nullable=False),
        sa.Column("started_at", _TIME, nullable=False),
        sa.Column("last_seen", _TIME, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_processes")),
    )
    op.create_table(
        "step_times",
        sa.Column("kind", sa.String(length=64), nullable=False),
        sa.Column("step", sa.String(length=32), nullable=False),
        sa.Column("count", sa.BigInteger(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("kind", "step", name=op.f("pk_step_times")),
    )
    op.create_index(op.f("ix_stages_calibration_id_created_at"), "stages", ["calibration_id", "created_at"])


def downgrade() -> None:
    """Take the change back."""
    op.drop_index(op.f("ix_stages_calibration_id_created_at"), "stages")
    op.drop_table("step_times")
    op.drop_table("processes")
