"""Radiographs of a surgery."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "radiographs",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("view", sa.String(length=8), nullable=False),
        sa.Column("positive_on", sa.String(length=8), nullable=False),
        sa.Column("row_spacing_mm", sa.Double(), nullable=False),
        sa.Column("column_spacing_mm", sa.Double(), nullable=False),
        sa.Column("spacing_source", sa.String(length=32), nullable=False),
        sa.Column("image_sha256", sa.String(length=64), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["surgery_id"], ["surgeries.id"], name=op.f("fk_radiographs_surgery_id_surgeries")
        ),
        sa.ForeignKeyConstraint(
            ["image_sha256"], ["images.sha256"], name=op.f("fk_radiographs_image_sha256_images")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_radiographs")),
    )
    op.create_index(op.f("ix_radiographs_surgery_id"), "radiographs", ["surgery_id"])


def downgrade() -> None:
    """Take the change back; the radiographs are lost, their images stay."""
    op.drop_index(op.f("ix_radiographs_surgery_id"), "radiographs")
    op.drop_table("radiographs")
