"""The audit: who, from where, with which outcome, in a hash chain; nothing that was recorded changes or goes unpurged.

The database itself refuses to change, replace or delete rows of the tables below. Rows of a surgery can be deleted when
``purges`` has it, which needs an event ``surgery:purged``; an image, when ``purged_images`` has it. A later migration
that rebuilds one of these tables on SQLite, as Alembic's batch operations do, must make its triggers again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

_TIME = sa.DateTime(timezone=True)
_BATCH = 1000
_BEFORE = ("at", "action", "actor_kind", "actor_name", "surgery_id", "subject_id")
_STAGE = "(SELECT surgery_id FROM stages WHERE id = OLD.stage_id)"
_FOR_EVER = ("events", "tombstones", "purges", "purged_images")
_SURGERY_OF = {
    "bursts": _STAGE,
    "features": _STAGE,
    "further_pairs": _STAGE,
    "measurements": _STAGE,
    "radiographs": "OLD.surgery_id",
    "spine_rebaselines": "OLD.surgery_id",
    "spine_setups": "OLD.surgery_id",
    "spines": "OLD.surgery_id",
    "stages": "OLD.surgery_id",
    "surgeries": "OLD.id",
    "triads": _STAGE,
}
"""For each table of a surgery, the surgery that a row belongs to."""

_KEYS = {
    "bursts": ("stage_id",),
    "events": ("seq",),
    "features": ("stage_id", "side"),
    "further_pairs": ("stage_id", "position"),
    "images": ("sha256",),
    "measurements": ("stage_id",),
    "purged_images": ("sha256", "surgery_id"),
    "purges": ("surgery_id",),
    "radiographs": ("id",),
    "sent_images": ("sent_sha256",),
    "spine_rebaselines": ("surgery_id", "position"),
    "spine_setups": ("surgery_id", "revision"),
    "spines": ("id",),
    "stages": ("id",),
    "surgeries": ("id",),
    "tombstones": ("surgery_id",),
    "triads": ("stage_id", "position"),
}
_CHANGEABLE = frozenset({"surgeries"})
"""Tables whose rows may be updated."""

_REFUSAL = "the record never changes: add a new row, or purge the surgery"
_UNAUDITED = "a purge needs its event in the audit"
_OUT_OF_ORDER = "the number of an event follows that of the last one"


def upgrade() -> None:
    """Make the change."""
    _make_events()
    op.create_table(
        "tombstones",
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("deleted_at", _TIME, nullable=False),
        sa.Column("actor_kind", sa.String(length=16), nullable=False),
        sa.Column("actor_name", sa.String(length=128), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("surgery_id", name=op.f("pk_tombstones")),
    )
    op.create_table(
        "purges",
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.Column("purged_at", _TIME, nullable=False),
        sa.Column("actor_kind", sa.String(length=16), nullable=False),
        sa.Column("actor_name", sa.String(length=128), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("export_sha256", sa.String(length=64), nullable=True),
        sa.ForeignKeyConstraint(
            ["surgery_id"], ["tombstones.surgery_id"], name=op.f("fk_purges_surgery_id_tombstones")
        ),
        sa.PrimaryKeyConstraint("surgery_id", name=op.f("pk_purges")),
    )
    op.create_table(
        "purged_images",
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=False),
        sa.ForeignKeyConstraint(
            ["surgery_id"], ["purges.surgery_id"], name=op.f("fk_purged_images_surgery_id_purges")
        ),
        sa.PrimaryKeyConstraint("sha256", "surgery_id", name=op.f("pk_purged_images")),
    )
    op.create_table(
        "sent_images",
        sa.Column("sent_sha256", sa.String(length=64), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("created_at", _TIME, nullable=False),
        sa.ForeignKeyConstraint(["sha256"], ["images.sha256"], name=op.f("fk_sent_images_sha256_images")),
        sa.PrimaryKeyConstraint("sent_sha256", name=op.f("pk_sent_images")),
    )
    op.create_index(op.f("ix_sent_images_sha256"), "sent_images", ["sha256"])
    for trigger in _triggers():
        trigger.create()


def downgrade() -> None:
    """Take the change back; the chain, tombstones, addresses and outcomes of the audit are lost."""
    for trigger in _triggers():
        trigger.drop()
    op.drop_table("sent_images")
    op.drop_table("purged_images")
    op.drop_table("purges")
    op.drop_table("tombstones")
    _set_aside()
    _create_events()
    columns = ", ".join(("seq", *_BEFORE))
    op.execute(f"INSERT INTO events ({columns}) SELECT {columns} FROM events_before ORDER BY seq")  # noqa: S608
    _continue_numbers()
    op.drop_table("events_before")


def _make_events() -> None:
    """Rebuild the table of events, each chained to the one before."""
    _set_aside()
    _create_events(
        sa.Column("actor_key", sa.String(length=16), nullable=True),
        sa.Column("address", sa.String(length=64), nullable=True),
        sa.Column("request_id", sa.String(length=64), nullable=True),
        sa.Column("outcome", sa.String(length=16), nullable=False),
        sa.Column("detail", sa.String(length=256), nullable=True),
        sa.Column("hash", sa.String(length=64), nullable=False),
    )
    connection = op.get_bind()
    before, after = _table("events_before"), _table("events")
    last, digest = None, "0" * 64
    while True:
        query = sa.select(before).order_by(before.c.seq).limit(_BATCH)
        query = query if last is None else query.where(before.c.seq > last)
        rows = connection.execute(query).mappings().all()
        if not rows:
            break
        chained = []
        for row in rows:
            entry = {
                **{name: row[name] for name in _BEFORE},
                "seq": row["seq"],
                "actor_key": None,
                "address": None,
                "request_id": None,
                "outcome": "success",
                "detail": None,
            }
            digest = _digest(digest, entry)
            chained.append({**entry, "hash": digest})
            last = row["seq"]
        connection.execute(after.insert(), chained)
    _continue_numbers()
    op.drop_table("events_before")


def _digest(previous: str, entry: dict[str, Any]) -> str:
    """Return the hash of an event (store/events.py)."""
    at: datetime = entry["at"]
    moment = at.replace(tzinfo=UTC) if at.tzinfo is None else at.astimezone(UTC)
    plain = {**entry, "at": moment.isoformat(timespec="microseconds")}
    canonical = json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(f"{previous}\n{canonical}".encode()).hexdigest()


def _set_aside() -> None:
    op.execute("CREATE TABLE events_before AS SELECT * FROM events")
    op.drop_table("events")


def _create_events(*further: sa.Column[Any]) -> None:
    op.create_table(
        "events",
        sa.Column("seq", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("at", _TIME, nullable=False),
        sa.Column("action", sa.String(length=64), nullable=False),
        sa.Column("actor_kind", sa.String(length=16), nullable=False),
        sa.Column("actor_name", sa.String(length=128), nullable=False),
        sa.Column("surgery_id", sa.String(length=36), nullable=True),
        sa.Column("subject_id", sa.String(length=36), nullable=False),
        *further,
        sa.PrimaryKeyConstraint("seq", name=op.f("pk_events")),
        sqlite_autoincrement=True,
    )
    op.create_index(op.f("ix_events_surgery_id"), "events", ["surgery_id"])


def _table(name: str) -> sa.TableClause:
    texts = ("action", "actor_kind", "actor_name", "surgery_id", "subject_id")
    added = ("actor_key", "address", "request_id", "outcome", "detail", "hash") if name == "events" else ()
    return sa.table(
        name,
        sa.column("seq", sa.BigInteger()),
        sa.column("at", _TIME),
        *(sa.column(n) for n in (*texts, *added)),
    )


def _continue_numbers() -> None:
    if not _on_sqlite():
        op.execute(
            "SELECT setval(pg_get_serial_sequence('events', 'seq'), coalesce(max(seq), 1), max(seq) IS NOT NULL)"
            " FROM events"
        )


class _Trigger:
    """A trigger that refuses what a condition holds for."""

    def __init__(self, table: str, name: str, event: str, condition: str, refusal: str) -> None:
        self._table, self._name, self._event = table, f"{table}_{name}", event
        self._condition, self._refusal = condition, refusal

    def create(self) -> None:
        if _on_sqlite():
            op.execute(
                f"CREATE TRIGGER {self._name} BEFORE {self._event} ON {self._table} WHEN {self._condition}"
                f" BEGIN SELECT RAISE(ABORT, '{self._refusal}'); END"
            )
            return
        row = "NULL" if self._event == "TRUNCATE" else "OLD" if self._event == "DELETE" else "NEW"
        op.execute(
            f"CREATE FUNCTION {self._name}() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN IF {self._condition} THEN"
            f" RAISE EXCEPTION '{self._refusal}' USING ERRCODE = 'restrict_violation'; END IF; RETURN {row}; END $$"
        )
        each = "STATEMENT" if self._event == "TRUNCATE" else "ROW"
        op.execute(
            f"CREATE TRIGGER {self._name} BEFORE {self._event} ON {self._table} FOR EACH {each}"
            f" EXECUTE FUNCTION {self._name}()"
        )

    def drop(self) -> None:
        if _on_sqlite():
            op.execute(f"DROP TRIGGER {self._name}")
        else:
            op.execute(f"DROP TRIGGER {self._name} ON {self._table}")
            op.execute(f"DROP FUNCTION {self._name}()")


def _triggers() -> Iterator[_Trigger]:
    for table, keys in _KEYS.items():
        if table not in _CHANGEABLE:
            yield _Trigger(table, "no_update", "UPDATE", "1 = 1", _REFUSAL)
        yield _Trigger(table, "no_delete", "DELETE", _not_purged(table), _REFUSAL)
        if not _on_sqlite():
            yield _Trigger(table, "no_truncate", "TRUNCATE", "1 = 1", _REFUSAL)
        elif table != "events":  # INSERT OR REPLACE deletes the row that is there without a trigger
            same = " AND ".join(f"{key} = NEW.{key}" for key in keys)
            there = f"EXISTS (SELECT 1 FROM {table} WHERE {same})"  # noqa: S608
            yield _Trigger(table, "no_replace", "INSERT", there, _REFUSAL)
    following = "NEW.seq <> (SELECT coalesce(max(seq), NEW.seq - 1) + 1 FROM events)"
    yield _Trigger("events", "in_order", "INSERT", following, _OUT_OF_ORDER)
    audited = (
        "NOT EXISTS (SELECT 1 FROM events WHERE surgery_id = NEW.surgery_id AND action = 'surgery:purged')"
    )
    yield _Trigger("purges", "audited", "INSERT", audited, _UNAUDITED)


def _not_purged(table: str) -> str:
    """Return the condition for refusing to delete a row."""
    if table in _FOR_EVER:
        return "1 = 1"
    if table in {"images", "sent_images"}:
        return "NOT EXISTS (SELECT 1 FROM purged_images WHERE sha256 = OLD.sha256)"
    return f"NOT EXISTS (SELECT 1 FROM purges WHERE surgery_id = {_SURGERY_OF[table]})"  # noqa: S608


def _on_sqlite() -> bool:
    return op.get_bind().dialect.name == "sqlite"
