"""What each pair of a stage was measured from: features of the pairs of a burst, and candidates with their rejections.

As with the other results, the database refuses to change or replace a row, and to delete one of a surgery that no purge
names.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

_TABLE = "pair_results"
_REFUSAL = "the record never changes: add a new row, or purge the surgery"
_PURGED = (
    "EXISTS (SELECT 1 FROM purges WHERE surgery_id = (SELECT surgery_id FROM stages WHERE id = OLD.stage_id))"
)
_THERE = f"EXISTS (SELECT 1 FROM {_TABLE} WHERE stage_id = NEW.stage_id AND pair = NEW.pair)"  # noqa: S608
_TRIGGERS = {
    "no_update": ("UPDATE", "1 = 1", "ROW", "NEW"),
    "no_delete": ("DELETE", f"NOT {_PURGED}", "ROW", "OLD"),
    "no_truncate": ("TRUNCATE", "1 = 1", "STATEMENT", "NULL"),
}
"""For each trigger its event, the condition for refusing it, what it is for, and what it returns."""


def upgrade() -> None:
    """Make the change."""
    op.create_table(
        _TABLE,
        sa.Column("stage_id", sa.String(length=36), nullable=False),
        sa.Column("pair", sa.Integer(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["stage_id"], ["measurements.stage_id"], name=op.f("fk_pair_results_stage_id_measurements")
        ),
        sa.PrimaryKeyConstraint("stage_id", "pair", name=op.f("pk_pair_results")),
    )
    if _on_sqlite():
        for name, event, condition in (
            ("no_update", "UPDATE", "1 = 1"),
            ("no_delete", "DELETE", f"NOT {_PURGED}"),
            ("no_replace", "INSERT", _THERE),  # INSERT OR REPLACE deletes without a trigger
        ):
            op.execute(
                f"CREATE TRIGGER {_TABLE}_{name} BEFORE {event} ON {_TABLE} WHEN {condition}"
                f" BEGIN SELECT RAISE(ABORT, '{_REFUSAL}'); END"
            )
        return
    for name, (event, condition, each, row) in _TRIGGERS.items():
        op.execute(
            f"CREATE FUNCTION {_TABLE}_{name}() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN IF {condition} THEN"
            f" RAISE EXCEPTION '{_REFUSAL}' USING ERRCODE = 'restrict_violation'; END IF; RETURN {row}; END $$"
        )
        op.execute(
            f"CREATE TRIGGER {_TABLE}_{name} BEFORE {event} ON {_TABLE} FOR EACH {each}"
            f" EXECUTE FUNCTION {_TABLE}_{name}()"
        )


def downgrade() -> None:
    """Take the change back; what pairs were measured from is lost, the results stay."""
    op.drop_table(_TABLE)
    if not _on_sqlite():
        for name in _TRIGGERS:
            op.execute(f"DROP FUNCTION {_TABLE}_{name}()")


def _on_sqlite() -> bool:
    return op.get_bind().dialect.name == "sqlite"
