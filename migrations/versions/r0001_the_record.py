"""The record."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        "calibrations",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("rig", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibrations")),
    )
    op.create_index(op.f("ix_calibrations_created_at"), "calibrations", ["created_at"])

    op.create_table(
        "changes",
        sa.Column("seq", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("action", sa.String(length=64), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=True),
        sa.Column("subject_id", sa.String(length=36), nullable=False),
        sa.PrimaryKeyConstraint("seq", name=op.f("pk_changes")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_changes_surgery_id"), "changes", ["surgery_id"])

    op.create_table(
        "images",
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.Column("media_type", sa.String(length=64), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.Column("size_bytes", sa.BigInteger(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_images")),
    )
    op.create_table(
        "surgeries",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("reference", sa.Text(), nullable=False),
        sa.Column("vertebrae", sa.JSON(), nullable=False),
        sa.Column("reference_vertebra", sa.String(length=16), nullable=False),
        sa.Column("spine_axis", sa.String(length=8), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_surgeries")),
    )
    op.create_index(op.f("ix_surgeries_created_at"), "surgeries", ["created_at"])

    op.create_table(
        "stages",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("take", sa.Integer(), nullable=False),
        sa.Column("calibration_id", sa.String(length=36), nullable=False),
        sa.Column("left_sha256", sa.String(length=64), nullable=False),
        sa.Column("right_sha256", sa.String(length=64), nullable=False),
        sa.Column("captured_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name=op.f("fk_stages_calibration_id_calibrations")
        ),
        sa.ForeignKeyConstraint(
            ["left_sha256"], ["images.sha256"], name=op.f("fk_stages_left_sha256_images")
        ),
        sa.ForeignKeyConstraint(
            ["right_sha256"], ["images.sha256"], name=op.f("fk_stages_right_sha256_images")
        ),
        sa.ForeignKeyConstraint(
            ["surgery_id"], ["surgeries.id"], name=op.f("fk_stages_surgery_id_surgeries")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_stages")),
        sa.UniqueConstraint("surgery_id", "name", "take", name=op.f("uq_stages_surgery_id_name_take")),
    )
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column(
            "state",
            sa.Enum(
                "queued",
                "running",
                "succeeded",
                "failed",
                "cancelled",
                name="state",
                native_enum=False,
                create_constraint=True,
                length=16,
            ),
            nullable=False,
        ),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("step", sa.String(length=64), nullable=True),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("lease_owner", sa.String(length=36), nullable=True),
        sa.Column("lease_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("rung_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.CheckConstraint("progress >= 0 AND progress <= 1", name=op.f("ck_jobs_progress")),
        sa.ForeignKeyConstraint(["stage_id"], ["stages.id"], name=op.f("fk_jobs_stage_id_stages")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_jobs")),
        sa.UniqueConstraint("stage_id", name=op.f("uq_jobs_stage_id")),
    )
    op.create_index(op.f("ix_jobs_state_rung_at"), "jobs", ["state", "rung_at"])

    op.create_table(
        "measurements",
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("flags", sa.JSON(), nullable=False),
        sa.Column("fields", sa.JSON(), nullable=False),
        sa.Column("exposure", sa.JSON(), nullable=False),
        sa.Column("parameters", sa.JSON(), nullable=False),
        sa.Column("version", sa.String(length=32), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["stage_id"], ["stages.id"], name=op.f("fk_measurements_stage_id_stages")),
        sa.PrimaryKeyConstraint("stage_id", name=op.f("pk_measurements")),
    )
    op.create_table(
        "features",
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("points", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["stage_id"], ["measurements.stage_id"], name=op.f("fk_features_stage_id_measurements")
        ),
        sa.PrimaryKeyConstraint("stage_id", "side", name=op.f("pk_features")),
    )
    op.create_table(
        "triads",
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(length=16), nullable=True),
        sa.Column("label_reason", sa.Text(), nullable=True),
        sa.Column("model", sa.String(length=64), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("x_mm", sa.Double(), nullable=True),
        sa.Column("y_mm", sa.Double(), nullable=True),
        sa.Column("z_mm", sa.Double(), nullable=True),
        sa.Column("x_sd_mm", sa.Double(), nullable=True),
        sa.Column("y_sd_mm", sa.Double(), nullable=True),
        sa.Column("z_sd_mm", sa.Double(), nullable=True),
        sa.Column("alpha_deg", sa.Double(), nullable=True),
        sa.Column("beta_deg", sa.Double(), nullable=True),
        sa.Column("gamma_deg", sa.Double(), nullable=True),
        sa.Column("error_mm", sa.Double(), nullable=False),
        sa.Column("normal", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("rotation", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("rotation_sd_deg", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("covariance", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("balls", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["stage_id"], ["measurements.stage_id"], name=op.f("fk_triads_stage_id_measurements")
        ),
        sa.PrimaryKeyConstraint("stage_id", "position", name=op.f("pk_triads")),
    )


def downgrade() -> None:
    """Take the change back."""
    op.drop_table("triads")
    op.drop_table("features")
    op.drop_table("measurements")
    op.drop_index(op.f("ix_jobs_state_rung_at"), "jobs")

    op.drop_table("jobs")
    op.drop_table("stages")
    op.drop_index(op.f("ix_surgeries_created_at"), "surgeries")

    op.drop_table("surgeries")
    op.drop_table("images")
    op.drop_index(op.f("ix_changes_surgery_id"), "changes")

    op.drop_table("changes")
    op.drop_index(op.f("ix_calibrations_created_at"), "calibrations")

    op.drop_table("calibrations")
