"""Calibrations from pictures: what was asked for, what is known of the result, and jobs that make them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_REQUEST = "fk_jobs_calibration_request_id_calibration_requests"


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "calibration_requests",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("control_field", sa.Text(), nullable=False),
        sa.Column("control_points", sa.Text(), nullable=True),
        sa.Column("options", sa.JSON(), nullable=False),
        sa.Column("captured_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration_requests")),
    )
    op.create_table(
        "calibration_shots",
        sa.Column("request_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("used", sa.Boolean(), nullable=False),
        sa.Column("left_sha256", sa.String(length=64), nullable=False),
        sa.Column("right_sha256", sa.String(length=64), nullable=False),
        sa.ForeignKeyConstraint(
            ["left_sha256"], ["images.sha256"], name=op.f("fk_calibration_shots_left_sha256_images")
        ),
        sa.ForeignKeyConstraint(
            ["request_id"],
            ["calibration_requests.id"],
            name=op.f("fk_calibration_shots_request_id_calibration_requests"),
        ),
        sa.ForeignKeyConstraint(
            ["right_sha256"], ["images.sha256"], name=op.f("fk_calibration_shots_right_sha256_images")
        ),
        sa.PrimaryKeyConstraint("request_id", "position", name=op.f("pk_calibration_shots")),
    )
    op.create_table(
        "calibration_reports",
        sa.Column("calibration_id", sa.String(length=36), nullable=False),
        sa.Column("report", sa.JSON(), nullable=False),
        sa.Column("version", sa.String(length=32), nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"],
            ["calibration_requests.id"],
            name=op.f("fk_calibration_reports_calibration_id_calibration_requests"),
        ),
        sa.ForeignKeyConstraint(
            ["calibration_id"],
            ["calibrations.id"],
            name=op.f("fk_calibration_reports_calibration_id_calibrations"),
        ),
        sa.PrimaryKeyConstraint("calibration_id", name=op.f("pk_calibration_reports")),
    )
    op.add_column("calibrations", sa.Column("calibrated_at", sa.DateTime(timezone=True), nullable=True))
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("calibration_request_id", sa.String(length=36), nullable=True))
        jobs.alter_column("stage_id", existing_type=sa.String(length=36), nullable=True)
        jobs.create_foreign_key(op.f(_REQUEST), "calibration_requests", ["calibration_request_id"], ["id"])
        jobs.create_unique_constraint(op.f("uq_jobs_calibration_request_id"), ["calibration_request_id"])
        jobs.create_check_constraint(
            op.f("ck_jobs_subject"), "(stage_id IS NULL) <> (calibration_request_id IS NULL)"
        )


def downgrade() -> None:
    """Take the change back; jobs and reports of calibrations are lost, their rigs stay."""
    op.execute("DELETE FROM jobs WHERE stage_id IS NULL")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_constraint(op.f("ck_jobs_subject"), type_="check")
        jobs.drop_constraint(op.f("uq_jobs_calibration_request_id"), type_="unique")
        jobs.drop_constraint(op.f(_REQUEST), type_="foreignkey")
        jobs.alter_column("stage_id", existing_type=sa.String(length=36), nullable=False)
        jobs.drop_column("calibration_request_id")
    op.drop_column("calibrations", "calibrated_at")
    op.drop_table("calibration_reports")
    op.drop_table("calibration_shots")
    op.drop_table("calibration_requests")
