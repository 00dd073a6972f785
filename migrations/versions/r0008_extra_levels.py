"""A surgery declares the vertebrae that its spine has in addition to the usual ones."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the change."""
    op.add_column(
        "surgeries", sa.Column("extra_levels", sa.JSON(), nullable=False, server_default=sa.text("'[]'"))
    )


def downgrade() -> None:
    """Take the change back; the declared vertebrae are lost."""
    op.drop_column("surgeries", "extra_levels")
