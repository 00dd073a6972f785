"""The export of one surgery before it is purged: a ZIP file with all its rows, images and events, which is verified.

``manifest.json`` has the SHA-256 of every other file, ``tables/`` the rows as JSON lines, ``images/`` the image files
under their SHA-256, ``audit.jsonl`` the events with their hashes.
"""

from __future__ import annotations

import json
import zipfile
from base64 import b64encode
from collections.abc import Iterator, Mapping
from datetime import datetime
from enum import Enum
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import ColumnElement, Table, select
from sqlalchemy.orm import Session

from store import audit, images, retention
from store.errors import ExportFileError, NotFoundError
from store.tables.base import Base
from store.tables.images import Image, SentImage
from store.tables.jobs import Job
from store.tables.stages import Stage
from store.tables.surgeries import Surgery

FORMAT = "spinewatch-case"
_MANIFEST = "manifest.json"
_BLOCK_BYTES = 1 << 20
_WRITTEN = (1980, 1, 1, 0, 0, 0)


def write_case(session: Session, surgery_id: str, stream: BinaryIO, version: str, now: datetime) -> str:
    """Write the export of a surgery and verify it.

    Parameters
    ----------
    session
        Session that reads, or the one that purges.
    surgery_id
        Identifier of the surgery.
    stream
        The new file, which can be read back.
    version
        Version of Spinewatch.
    now
        Time of the export.

    Returns
    -------
    str
        SHA-256 of the file, hexadecimal.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    ImageDamagedError
        An image differs from its SHA-256.
    ExportFileError
        What was written is not what is read back.
    """
    if session.get(Surgery, surgery_id) is None:
        raise NotFoundError("surgery")
    digests: dict[str, str] = {}
    rows: dict[str, int] = {}
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in _files(session, surgery_id, rows):
            _add(archive, name, content)
            digests[name] = sha256(content).hexdigest()
        manifest = {
            "format": FORMAT,
            "spinewatch": version,
            "surgery_id": surgery_id,
            "exported_at": now.isoformat(),
            "rows": rows,
            "sha256": digests,
        }
        _add(archive, _MANIFEST, json.dumps(manifest, indent=1, sort_keys=True).encode())
    stream.flush()
    read_case(stream)
    stream.seek(0)
    whole = sha256()
    while block := stream.read(_BLOCK_BYTES):
        whole.update(block)
    return whole.hexdigest()


def read_case(file: Path | BinaryIO) -> Mapping[str, Any]:
    """Verify the export of a surgery and return its manifest.

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    mapping
        The manifest.

    Raises
    ------
    ExportFileError
        It is not such an export, or a file in it is missing or differs from its SHA-256.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            manifest: dict[str, Any] = json.loads(archive.read(_MANIFEST))
            digests = manifest["sha256"]
            found = {
                name: sha256(archive.read(name)).hexdigest()
                for name in archive.namelist()
                if name != _MANIFEST
            }
            damaged = sorted(name for name in digests | found if digests.get(name) != found.get(name))
            for name, number in manifest["rows"].items():
                if archive.read(f"tables/{name}.jsonl").count(b"\n") != number:
                    damaged.append(f"tables/{name}.jsonl")
    except (OSError, zipfile.BadZipFile, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ExportFileError(f"the export of the case is damaged: {error}; nothing was removed") from error
    if damaged or manifest.get("format") != FORMAT:
        raise ExportFileError(f"the export of the case is damaged: {', '.join(damaged) or 'another format'}")
    return manifest


def _files(session: Session, surgery_id: str, rows: dict[str, int]) -> Iterator[tuple[str, bytes]]:
    stage_ids = retention.stages_of(session, surgery_id)
    digests = retention.images_of(session, surgery_id)
    for table, condition in (
        *retention.conditions(surgery_id, stage_ids),
        *_further(surgery_id, stage_ids, digests),
    ):
        columns = [
            column
            for column in table.columns
            if table.name != Image.__tablename__ or column.name != "content"
        ]
        query = select(*columns).where(condition).order_by(*table.primary_key.columns)
        lines = [_line(row) for row in session.execute(query).mappings()]
        if lines:
            rows[table.name] = len(lines)
            yield f"tables/{table.name}.jsonl", b"".join(lines)
    for digest in digests:
        yield f"images/{digest}", images.content(session, digest)
    of_surgery = (event.model_dump(mode="json") for event in audit.all_events(session, surgery_id))
    yield "audit.jsonl", b"".join(_line(event) for event in of_surgery)


def _further(
    surgery_id: str, stage_ids: list[str], digests: list[str]
) -> Iterator[tuple[Table, ColumnElement[bool]]]:
    """Yield what belongs to a surgery without naming it: calibrations, jobs, and what is known of images."""
    tables = Base.metadata.tables
    used = select(Stage.calibration_id).where(Stage.surgery_id == surgery_id)
    calibrations, reports = tables["calibrations"], tables["calibration_reports"]
    yield calibrations, calibrations.c.id.in_(used)
    yield reports, reports.c.calibration_id.in_(used)
    jobs = tables[Job.__tablename__]
    yield jobs, jobs.c.subject_id.in_([surgery_id, *stage_ids])
    yield tables[Image.__tablename__], tables[Image.__tablename__].c.sha256.in_(digests)
    yield tables[SentImage.__tablename__], tables[SentImage.__tablename__].c.sha256.in_(digests)


def _line(row: Mapping[Any, Any]) -> bytes:
    return f"{json.dumps(dict(row), default=_plain, sort_keys=True)}\n".encode()


def _plain(value: object) -> Any:
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, bytes):
        return b64encode(value).decode()
    raise TypeError(f"no JSON form of {type(value).__name__}")


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, _WRITTEN)
    stored = name.startswith("images/")  # compressed already
    entry.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    entry.external_attr = 0o600 << 16
    archive.writestr(entry, content)
