"""Times of steps by size, for histograms; sums of before, whose sizes are not known, start anew."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the change."""
    op.drop_table("step_times")
    op.create_table(
        "step_times",
        sa.Column("kind", sa.String(length=64), nullable=False),
        sa.Column("step", sa.String(length=32), nullable=False),
        sa.Column("bucket", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("count", sa.BigInteger(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("kind", "step", "bucket", name=op.f("pk_step_times")),
    )


def downgrade() -> None:
    """Take the change back; the sums start anew."""
    op.drop_table("step_times")
    op.create_table(
        "step_times",
        sa.Column("kind", sa.String(length=64), nullable=False),
        sa.Column("step", sa.String(length=32), nullable=False),
        sa.Column("count", sa.BigInteger(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("kind", "step", name=op.f("pk_step_times")),
    )
