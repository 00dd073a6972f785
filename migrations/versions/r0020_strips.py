"""A strip of each image is kept with its features: later stages are told from it without decoding the image again."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the change."""
    op.add_column("features", sa.Column("strip", sa.LargeBinary(), nullable=True))


def downgrade() -> None:
    """Take the change back; strips are lost, and images are decoded again instead."""
    op.drop_column("features", "strip")
