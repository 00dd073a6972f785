"""Calibrations never change and never go, whoever asks: results are worth nothing without the rig they came from.

The tables are those of a calibration and of what it was made from. A later migration that makes one of them
anew on SQLite, as Alembic's batch operations do, must make its triggers anew.
"""

from __future__ import annotations

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

_TABLES = ("calibrations", "calibration_requests", "calibration_shots", "calibration_reports")
_ACTIONS = ("update", "delete")
_REFUSAL = "calibrations never change: add a new one"


def upgrade() -> None:
    """Make the change."""
    if _on_sqlite():
        for table, action in _each():
            op.execute(
                f"CREATE TRIGGER {table}_no_{action} BEFORE {action.upper()} ON {table}"
                f" BEGIN SELECT RAISE(ABORT, '{_REFUSAL}'); END"
            )
        return
    op.execute(
        "CREATE FUNCTION refuse_calibration_change() RETURNS trigger LANGUAGE plpgsql AS"
        f" $$ BEGIN RAISE EXCEPTION '{_REFUSAL}' USING ERRCODE = 'restrict_violation'; END $$"
    )
    for table, action in _each():
        op.execute(
            f"CREATE TRIGGER {table}_no_{action} BEFORE {action.upper()} ON {table}"
            " FOR EACH ROW EXECUTE FUNCTION refuse_calibration_change()"
        )


def downgrade() -> None:
    """Take the change back."""
    for table, action in _each():
        on = "" if _on_sqlite() else f" ON {table}"
        op.execute(f"DROP TRIGGER {table}_no_{action}{on}")
    if not _on_sqlite():
        op.execute("DROP FUNCTION refuse_calibration_change()")


def _each() -> list[tuple[str, str]]:
    return [(table, action) for table in _TABLES for action in _ACTIONS]


def _on_sqlite() -> bool:
    return op.get_bind().dialect.name == "sqlite"
