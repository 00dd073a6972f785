"""Jobs of any kind: a kind, a subject and a payload instead of one column per kind of subject."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_STATES = ("queued", "running", "succeeded", "failed", "cancelled")
_KEPT = "state, progress, step, error, attempts, lease_owner, lease_until"
_TIMES = "created_at, started_at, finished_at"


def upgrade() -> None:
    """Make the change."""
    _set_aside("ix_jobs_state_rung_at")
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("kind", sa.String(length=64), nullable=False),
        sa.Column("subject_id", sa.String(length=36), nullable=False),
        sa.Column("payload", sa.JSON(), nullable=False),
        *_work("enqueued_at"),
    )
    op.create_index(op.f("ix_jobs_state_enqueued_at"), "jobs", ["state", "enqueued_at"])
    op.create_index(op.f("ix_jobs_kind_subject_id"), "jobs", ["kind", "subject_id"])
    surgery = "json_build_object('surgery_id'," if _on_postgresql() else "json_object('surgery_id',"
    nothing = "'{}'::json" if _on_postgresql() else "'{}'"
    op.execute(
        f"INSERT INTO jobs (id, kind, subject_id, payload, {_KEPT}, enqueued_at, {_TIMES})"  # noqa: S608
        f" SELECT id, 'stage', stage_id, {surgery}"
        f" (SELECT surgery_id FROM stages WHERE stages.id = stage_id)), {_KEPT}, rung_at, {_TIMES}"
        " FROM jobs_before WHERE stage_id IS NOT NULL"
    )
    op.execute(
        f"INSERT INTO jobs (id, kind, subject_id, payload, {_KEPT}, enqueued_at, {_TIMES})"  # noqa: S608
        f" SELECT id, 'calibration', calibration_request_id, {nothing}, {_KEPT}, rung_at, {_TIMES}"
        " FROM jobs_before WHERE stage_id IS NULL"
    )
    op.drop_table("jobs_before")


def downgrade() -> None:
    """Take the change back; jobs of other kinds are lost."""
    op.drop_index(op.f("ix_jobs_kind_subject_id"), "jobs")
    _set_aside("ix_jobs_state_enqueued_at")
    request = "fk_jobs_calibration_request_id_calibration_requests"
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("stage_id", sa.String(length=36), nullable=True),
        *_work("rung_at"),
        sa.Column("calibration_request_id", sa.String(length=36), nullable=True),
        sa.CheckConstraint(
            "(stage_id IS NULL) <> (calibration_request_id IS NULL)", name=op.f("ck_jobs_subject")
        ),
        sa.ForeignKeyConstraint(["stage_id"], ["stages.id"], name=op.f("fk_jobs_stage_id_stages")),
        sa.ForeignKeyConstraint(["calibration_request_id"], ["calibration_requests.id"], name=op.f(request)),
        sa.UniqueConstraint("stage_id", name=op.f("uq_jobs_stage_id")),
        sa.UniqueConstraint("calibration_request_id", name=op.f("uq_jobs_calibration_request_id")),
    )
    op.create_index(op.f("ix_jobs_state_rung_at"), "jobs", ["state", "rung_at"])
    for kind, subject in (("stage", "stage_id"), ("calibration", "calibration_request_id")):
        op.execute(
            f"INSERT INTO jobs (id, {subject}, {_KEPT}, rung_at, {_TIMES})"  # noqa: S608
            f" SELECT id, subject_id, {_KEPT}, enqueued_at, {_TIMES} FROM jobs_before WHERE kind = '{kind}'"
        )
    op.drop_table("jobs_before")


def _work(enqueued_at: str) -> tuple[sa.Column[object] | sa.Constraint, ...]:
    return (
        sa.Column(
            "state",
            sa.Enum(*_STATES, name="state", native_enum=False, create_constraint=True, length=16),
            nullable=False,
        ),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("step", sa.String(length=64), nullable=True),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("lease_owner", sa.String(length=36), nullable=True),
        sa.Column("lease_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column(enqueued_at, sa.DateTime(timezone=True), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.CheckConstraint("progress >= 0 AND progress <= 1", name=op.f("ck_jobs_progress")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_jobs")),
    )


def _set_aside(index: str) -> None:
    """Move the rows into jobs_before, without constraints, whose names the new table needs."""
    op.execute("CREATE TABLE jobs_before AS SELECT * FROM jobs")
    op.drop_index(op.f(index), "jobs")
    op.drop_table("jobs")


def _on_postgresql() -> bool:
    return op.get_bind().dialect.name == "postgresql"
