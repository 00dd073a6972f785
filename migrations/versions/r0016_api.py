"""Answers to requests with an idempotency key, revisions of stages, and indexes of the lists."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0014"
branch_labels = None
depends_on = None

_TIME = sa.DateTime(timezone=True)
_COLUMNS = (
    ("revised_take", sa.Integer()),
    ("changes", sa.JSON()),
    ("revised_at", _TIME),
    ("revised_by", sa.String(length=128)),
)


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "idempotency_keys",
        sa.Column("scope", sa.String(length=128), nullable=False),
        sa.Column("key", sa.String(length=255), nullable=False),
        sa.Column("fingerprint", sa.String(length=64), nullable=False),
        sa.Column("status", sa.Integer(), nullable=False),
        sa.Column("headers", sa.JSON(), nullable=False),
        sa.Column("body", sa.Text(), nullable=False),
        sa.Column("created_at", _TIME, nullable=False),
        sa.Column("expires_at", _TIME, nullable=False),
        sa.PrimaryKeyConstraint("scope", "key", name=op.f("pk_idempotency_keys")),
    )
    op.create_index(op.f("ix_idempotency_keys_expires_at"), "idempotency_keys", ["expires_at"])
    for name, kind in _COLUMNS:  # one by one: a table that is made anew would lose its triggers
        op.add_column("stages", sa.Column(name, kind, nullable=True))
    op.create_index(op.f("ix_stages_surgery_id_created_at"), "stages", ["surgery_id", "created_at"])
    op.create_index(op.f("ix_jobs_created_at"), "jobs", ["created_at"])


def downgrade() -> None:
    """Take the change back; what was asked for in revisions is lost, their results stay as takes."""
    op.drop_index(op.f("ix_jobs_created_at"), "jobs")
    op.drop_index(op.f("ix_stages_surgery_id_created_at"), "stages")
    for name, _ in reversed(_COLUMNS):
        op.drop_column("stages", name)
    op.drop_table("idempotency_keys")
