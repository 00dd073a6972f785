"""Results as contract models: a triad and a measurement are one JSON document each, no column per number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_TABLES = ("measurements", "features", "triads")
_RENAMED = {"chance": "p_value", "turn_deg": "rotation_deg", "turn_sd_deg": "rotation_sd_deg"}
_VECTORS = {
    "position_mm": ("x_mm", "y_mm", "z_mm"),
    "position_sd_mm": ("x_sd_mm", "y_sd_mm", "z_sd_mm"),
    "angles_deg": ("alpha_deg", "beta_deg", "gamma_deg"),
}
_MATRICES = ("normal", "rotation", "rotation_sd_deg", "covariance")
_TRIAD = (
    "label",
    "label_reason",
    "model",
    "reason",
    "position_mm",
    "position_sd_mm",
    "normal",
    "angles_deg",
    "rotation",
    "rotation_sd_deg",
    "covariance",
    "error_mm",
    "balls",
)
_RESULT = ("fields", "exposure", "flags", "rig_check", "parameters", "version")


def upgrade() -> None:
    """Make the change."""
    _set_aside()
    op.create_table(
        "measurements",
        _id(),
        sa.Column("result", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        *_keys("measurements", "stages.id", "stage_id"),
    )
    _create_features()
    op.create_table(
        "triads",
        _id(),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(length=16), nullable=True),
        sa.Column("triad", sa.JSON(), nullable=False),
        *_keys("triads", "measurements.stage_id", "stage_id", "position"),
    )
    for row in _rows(_measurements_0004("measurements_before")):
        result = {name: row[name] for name in _RESULT}
        if result["rig_check"] is not None:
            result["rig_check"] = {_RENAMED.get(k, k): v for k, v in result["rig_check"].items()}
        _insert(_measurements_0007("measurements"), row, result={**result, "templates": None})
    _copy_features()
    for row in _rows(_triads_0004("triads_before")):
        vectors = {name: _vector(row, columns) for name, columns in _VECTORS.items()}
        triad = {name: vectors[name] if name in vectors else row[name] for name in _TRIAD}
        _insert(_triads_0007("triads"), row, triad=triad)
    _drop_set_aside()


def downgrade() -> None:
    """Take the change back; the version of the template set is lost."""
    _set_aside()
    op.create_table(
        "measurements",
        _id(),
        *(
            sa.Column(name, sa.JSON(), nullable=False)
            for name in ("flags", "fields", "exposure", "parameters")
        ),
        sa.Column("version", sa.String(length=32), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("rig_check", sa.JSON(none_as_null=True), nullable=True),
        *_keys("measurements", "stages.id", "stage_id"),
    )
    _create_features()
    op.create_table(
        "triads",
        _id(),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(length=16), nullable=True),
        sa.Column("label_reason", sa.Text(), nullable=True),
        sa.Column("model", sa.String(length=64), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        *(sa.Column(name, sa.Double(), nullable=True) for columns in _VECTORS.values() for name in columns),
        sa.Column("error_mm", sa.Double(), nullable=False),
        *(sa.Column(name, sa.JSON(none_as_null=True), nullable=True) for name in _MATRICES),
        sa.Column("balls", sa.JSON(), nullable=False),
        *_keys("triads", "measurements.stage_id", "stage_id", "position"),
    )
    back = {new: old for old, new in _RENAMED.items()}
    for row in _rows(_measurements_0007("measurements_before")):
        result = {name: row["result"][name] for name in _RESULT}
        if result["rig_check"] is not None:
            result["rig_check"] = {back.get(k, k): v for k, v in result["rig_check"].items()}
        _insert(_measurements_0004("measurements"), row, **result)
    _copy_features()
    for row in _rows(_triads_0007("triads_before")):
        triad = row["triad"]
        numbers = {
            column: None if triad[name] is None else triad[name][i]
            for name, columns in _VECTORS.items()
            for i, column in enumerate(columns)
        }
        rest = {name: triad[name] for name in _TRIAD if name not in _VECTORS}
        _insert(_triads_0004("triads"), row, **numbers, **rest)
    _drop_set_aside()


def _id() -> sa.Column[str]:
    return sa.Column("stage_id", sa.String(length=36), nullable=False)


def _keys(table: str, parent: str, *primary: str) -> tuple[sa.Constraint, ...]:
    name = f"fk_{table}_stage_id_{parent.partition('.')[0]}"
    return (
        sa.ForeignKeyConstraint(["stage_id"], [parent], name=op.f(name)),
        sa.PrimaryKeyConstraint(*primary, name=op.f(f"pk_{table}")),
    )


def _create_features() -> None:
    op.create_table(
        "features",
        _id(),
        sa.Column("side", sa.String(length=8), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("points", sa.JSON(), nullable=False),
        *_keys("features", "measurements.stage_id", "stage_id", "side"),
    )


def _copy_features() -> None:
    op.execute("INSERT INTO features (stage_id, side, count, points) SELECT * FROM features_before")


def _set_aside() -> None:
    """Move the rows into tables without constraints: SQLite drops no table that others refer to."""
    for table in _TABLES:
        columns = "stage_id, side, count, points" if table == "features" else "*"
        op.execute(f"CREATE TABLE {table}_before AS SELECT {columns} FROM {table}")  # noqa: S608
    for table in reversed(_TABLES):
        op.drop_table(table)


def _drop_set_aside() -> None:
    for table in _TABLES:
        op.drop_table(f"{table}_before")


def _rows(table: sa.TableClause) -> Iterator[dict[str, Any]]:
    """Yield the rows stage by stage, so that memory holds one stage's."""
    connection = op.get_bind()
    for stage_id in connection.scalars(sa.select(table.c.stage_id).distinct()).all():
        for row in connection.execute(sa.select(table).where(table.c.stage_id == stage_id)).mappings():
            yield dict(row)


def _insert(table: sa.TableClause, row: dict[str, Any], **values: Any) -> None:
    names = {column.name for column in table.c}
    op.get_bind().execute(table.insert().values({k: v for k, v in row.items() if k in names} | values))


def _vector(row: dict[str, Any], columns: tuple[str, ...]) -> list[float] | None:
    values = [row[name] for name in columns]
    return None if None in values else values


def _time() -> sa.Column[Any]:
    """Return the column of a time, which SQLite holds as text: it is copied as it is."""
    on_sqlite = op.get_bind().dialect.name == "sqlite"
    return sa.Column("created_at", sa.String() if on_sqlite else sa.DateTime(timezone=True))


def _measurements_0004(name: str) -> sa.TableClause:
    documents = (sa.column(n, sa.JSON()) for n in ("flags", "fields", "exposure", "parameters"))
    check = sa.column("rig_check", sa.JSON(none_as_null=True))
    return sa.table(name, sa.column("stage_id"), *documents, check, sa.column("version"), _time())


def _measurements_0007(name: str) -> sa.TableClause:
    return sa.table(name, sa.column("stage_id"), sa.column("result", sa.JSON()), _time())


def _triads_0004(name: str) -> sa.TableClause:
    plain = ("stage_id", "position", "label", "label_reason", "model", "reason", "error_mm")
    names = [column for columns in _VECTORS.values() for column in columns]
    numbers: list[sa.ColumnClause[Any]] = [sa.column(column, sa.Double()) for column in names]
    documents = (sa.column(n, sa.JSON(none_as_null=True)) for n in (*_MATRICES, "balls"))
    return sa.table(name, *_columns(*plain), *numbers, *documents)


def _triads_0007(name: str) -> sa.TableClause:
    return sa.table(name, *_columns("stage_id", "position", "label"), sa.column("triad", sa.JSON()))


def _columns(*names: str) -> list[sa.ColumnClause[Any]]:
    return [sa.column(name) for name in names]
