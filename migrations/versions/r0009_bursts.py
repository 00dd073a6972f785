"""Bursts of stereo pairs, times of exposure of each view, and jobs that wait for another one."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_EXPOSED = ("left_exposed_at", "right_exposed_at")
_SIDES = ("left", "right")


def upgrade() -> None:
    """Make the change."""
    for name in _EXPOSED:
        op.add_column("stages", sa.Column(name, sa.DateTime(timezone=True), nullable=True))
    op.create_table(
        "further_pairs",
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        *(sa.Column(f"{side}_sha256", sa.String(length=64), nullable=False) for side in _SIDES),
        *(sa.Column(name, sa.DateTime(timezone=True), nullable=True) for name in _EXPOSED),
        sa.ForeignKeyConstraint(["stage_id"], ["stages.id"], name=op.f("fk_further_pairs_stage_id_stages")),
        *(
            sa.ForeignKeyConstraint(
                [f"{side}_sha256"], ["images.sha256"], name=op.f(f"fk_further_pairs_{side}_sha256_images")
            )
            for side in _SIDES
        ),
        sa.PrimaryKeyConstraint("stage_id", "position", name=op.f("pk_further_pairs")),
    )
    op.create_table(
        "bursts",
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("burst", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["stage_id"], ["measurements.stage_id"], name=op.f("fk_bursts_stage_id_measurements")
        ),
        sa.PrimaryKeyConstraint("stage_id", name=op.f("pk_bursts")),
    )
    op.add_column("jobs", sa.Column("waits_for", sa.String(length=36), nullable=True))
    op.create_index(op.f("ix_jobs_waits_for"), "jobs", ["waits_for"])


def downgrade() -> None:
    """Take the change back; the times of exposure and the bursts of stages are lost."""
    op.drop_index(op.f("ix_jobs_waits_for"), "jobs")
    op.drop_column("jobs", "waits_for")
    op.drop_table("bursts")
    op.drop_table("further_pairs")
    for name in _EXPOSED:
        op.drop_column("stages", name)
