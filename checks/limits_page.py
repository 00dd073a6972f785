"""The fixed limits in docs/operations.md: ``python -m checks.limits_page`` compares, ``--write`` writes them.

The page is read from the constants themselves. A constant of these rooms whose name says that it is a limit must be
on the page, or in ``NO_LIMITS`` with the parameters of the method and the sizes of caches.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from importlib import import_module
from pathlib import Path

PROJECT = Path(__file__).parents[1]
PAGE = PROJECT / "docs" / "operations.md"

_FIRST, _LAST = "<!-- limits -->", "<!-- /limits -->"
_ROOMS = ("contract", "service", "settings", "spinewatch/imaging", "store", "workers")
_NAMES = ("MAX_", "MIN_", "_MAX_", "_MIN_")


@dataclass(frozen=True)
class Limit:
    """A constant, and what it limits."""

    module: str
    name: str
    meaning: str

    @property
    def value(self) -> str:
        """The value as it is printed; a time in seconds."""
        value = getattr(import_module(self.module), self.name)
        if isinstance(value, timedelta):
            value = value.total_seconds()
        return f"{value:g}" if isinstance(value, float) else str(value)


def _of(module: str, **meanings: str) -> list[Limit]:
    return [Limit(module, name, meaning) for name, meaning in meanings.items()]


_REQUESTS = _of(
    "service.limits",
    MAX_HEAD_BYTES="bytes of the request line and headers together; 431",
    MAX_TARGET_BYTES="bytes of the request line; 414",
    MAX_HEADERS="headers of a request; 431",
    MAX_QUERY_PARAMETERS="parameters of a query; 414",
    MAX_JSON_VALUES="values of a JSON document: objects, arrays, texts and numbers; 422",
    MAX_JSON_DEPTH="levels of a JSON document; 422",
    MAX_JSON_DIGITS="characters of one number in JSON; 422",
    MAX_TEXT_PART_BYTES="bytes of a part of a form that is no file; 400",
    MAX_ERRORS="entries in `errors` of one problem",
    MIN_BODY_RATE="bytes per second of a body that extend its time by one second; 408",
)
_FURTHER = [
    *_of("service.plan_query", MAX_VERTEBRAE="vertebrae of a plan; 422"),
    *_of("service.routes.points", MAX_POINTS="points of one request for their reconstruction; 422"),
    *_of(
        "contract.measuring",
        MAX_MARKERS="kinds of markers of a stage; 422",
        _MAX_RANGE_MM="farthest range of the markers of a stage, mm; 422",
    ),
    *_of(
        "service.connection",
        _MIN_READ_RATE="bytes per second that a client reads at least, or it is disconnected",
        _MAX_SHARE="share of all connections; while none is free, the key or address with most loses one above it",
    ),
    *_of("service.watch", MAX_WAITING="streams and requests with `wait` of one key at once; 429"),
    *_of("service.forms.stage", MAX_PAIRS="pairs of a burst; 422"),
    *_of("service.forms.calibration", MAX_SHOTS="shots of a calibration; 422"),
    *_of(
        "contract.parameter_ranges",
        MAX_FACTOR="number of a revision's parameters over its default; 422",
        MAX_COUNT_FACTOR="whole number of a revision's parameters over its default; 422",
        MAX_ITEMS="items of a list of a revision's parameters; 422",
    ),
    *_of("service.forms.calibration", _MAX_TOTAL_PIXELS="pixels of all shots of a calibration together; 422"),
    *_of(
        "service.forms.control_field",
        _MAX_CSV_BYTES="bytes of a control field as CSV; 422",
        _MAX_NAME_LENGTH="characters of the name of a calibration; 422",
    ),
    *_of(
        "service.forms.spine_csv",
        _MAX_ROWS="rows of a spine as CSV; 422",
        _MAX_BYTES="bytes of a spine as CSV; 422",
    ),
    *_of(
        "service.radiograph_process",
        MAX_CPU_SECONDS="CPU time of the process that decodes a radiograph, s; 422",
        MAX_MEMORY_BYTES="address space of that process, bytes; 422",
        MAX_SECONDS="time of that process, s; 503",
    ),
    *_of(
        "service.export_process",
        MAX_CPU_SECONDS="CPU time of the process that makes an export, s; 422",
        MAX_MEMORY_BYTES="address space of that process, bytes; 422",
        MAX_SECONDS="time of that process, s; 503",
    ),
    *_of(
        "service.limited_process",
        _MAX_LOGGED="bytes of what such a process says when it breaks that are logged",
    ),
    *_of(
        "service.turns",
        MAX_DECODINGS="radiographs that are decoded at once; further ones wait",
        MAX_EXPORTS="exports that are made at once; further ones wait",
        MAX_PLANS="plans that are computed at once; further ones wait",
        MAX_WAIT_SECONDS="time that a request waits for its turn at one of these, s; 503",
        MAX_WRITERS="requests that write at once; further ones wait",
        MAX_WRITE_WAIT_SECONDS="time that a request waits for its turn at writing, s; 503",
    ),
    *_of("contract.revision", MAX_EDITS="edits of one kind in a revision of a stage; 422"),
    *_of(
        "contract.explanation",
        MAX_POINTS="points that an explanation lists; the others are counted",
        MAX_TRIADS="candidate triads that an explanation lists; the others are counted",
    ),
    *_of("service.routes.changes", MAX_NUMBER="largest number of a change; 422"),
]
_IMAGES = [
    *_of("spinewatch.imaging.header", MAX_PIXELS="pixels of an image", _MAX_BITS="bits per pixel"),
    *_of(
        "spinewatch.imaging.dicom",
        MAX_RADIOGRAPH_PIXELS="pixels of a radiograph",
        MAX_HEADER_BYTES="bytes of a DICOM header",
        _MAX_ELEMENTS="elements of a DICOM header",
        _MAX_ITEMS="items of the sequences of a DICOM header",
        _MAX_VALUE_BYTES="bytes of a value that is read from a DICOM header",
    ),
    *_of(
        "spinewatch.imaging.png_chunks",
        _MAX_CHUNKS="chunks of a PNG",
        _MAX_ANCILLARY="chunks of a PNG that are not of the image itself",
        _MAX_COMPRESSED="compressed chunks of a PNG that are not of the image itself",
        _MAX_ANCILLARY_BYTES="bytes of all chunks of a PNG that are not of the image itself",
    ),
    *_of(
        "spinewatch.imaging.tiff_directory",
        _MAX_ENTRIES="entries of a TIFF directory",
        _MAX_SEGMENTS="strips or tiles of a TIFF",
        _MAX_RATIONALS="fractions in an entry of a TIFF",
        _MAX_NUMBERS="numbers in all entries of a TIFF",
        _MAX_BYTES="bytes of all entries of a TIFF",
        _MAX_TILE_PIXELS="pixels of a tile of a TIFF",
    ),
    *_of("spinewatch.imaging.tiff_segments", _MAX_PADDED_PIXELS="pixels of all tiles of a TIFF"),
    *_of("spinewatch.imaging.tiff_metadata", _MAX_VALUES="values of an entry of a TIFF that is kept"),
    *_of(
        "spinewatch.imaging.jpeg_segments",
        _MAX_SEGMENTS="segments of a JPEG",
        _MAX_METADATA_BYTES="bytes of all segments of a JPEG that are not of the image itself",
        _MAX_SCANS="scans of a progressive JPEG",
    ),
]
_ACCESS = [
    *_of("store.sessions", MAX_SESSIONS="sessions of one key; a further one ends the oldest"),
    *_of(
        "service.failed_attempts",
        MAX_FAILURES="failed attempts of one address in the time below; 429",
        WINDOW_SECONDS="that time, s",
        MAX_ADDRESSES="addresses whose failed attempts are counted",
    ),
    *_of(
        "service.middleware.refusals",
        MAX_OF_ADDRESS="refusals of one address that the audit has in the time below; further ones are counted",
        MAX_OF_ALL="refusals of all addresses that the audit has in that time",
        WINDOW_SECONDS="that time, s",
    ),
]
_WORK = [
    *_of("store.leases", _MAX_STARTS="starts of a job, those included that were no fault of its own"),
    *_of("store.database", _BUSY_SECONDS="time that a transaction waits for another one on SQLite, s; 503"),
    *_of("store.events", MAX_DETAIL="characters of a detail in the list of events"),
    *_of(
        "store.processes",
        REPORT_SECONDS="time between two reports of a worker, s",
        MISSED_AFTER="time without a report after which a worker is missed, s",
    ),
    *_of("store.figures", MAX_CALIBRATIONS="calibrations, the newest, whose drift is in the metrics"),
    *_of("store.verification", _MAX_PROBLEMS="problems of a backup that are printed"),
    *_of(
        "service.server",
        _GRACE_S="time in which requests may end after the signal to stop, s",
        _GIVE_UP_S="time after that signal at which the server ends, s",
    ),
    *_of(
        "commands.shared.supervisor", _STOP_SECONDS="time in which all processes of `spinewatch run` end, s"
    ),
    *_of(
        "commands.shared.repeated_events", _EVERY_SECONDS="time in which a repeated warning is logged once, s"
    ),
]
_FILES = [
    *_of(
        "store.regular_file",
        MAX_DOCUMENT_BYTES="bytes of a document, table, certificate or template set",
        MAX_IMAGE_BYTES="bytes of an image",
    ),
    *_of("spinewatch.array_file", LARGEST_BYTES="bytes of all arrays of a template set"),
    *_of("store.audit_file", _MAX_LINE_BYTES="bytes of a line of a copy of the audit"),
]
_TABLES: Sequence[tuple[str, Sequence[Limit]]] = (
    ("", _REQUESTS),
    ("Forms and documents; the limits of single fields are in the OpenAPI document:", _FURTHER),
    ("Images, which fail with `invalid-image`:", _IMAGES),
    ("Access:", _ACCESS),
    ("Jobs, the database and the processes:", _WORK),
    ("Files that commands and workers read, which must be regular files, not devices or pipes:", _FILES),
)
NO_LIMITS = frozenset(
    {
        "service/access._MAX_KNOWN",
        "service/access._MAX_THREADS",
        "service/dependencies._MAX_ADDRESS_LENGTH",
        "service/dependencies._MAX_NAME_LENGTH",
        "service/http_head._MIN_CHUNK_BYTES",
        "service/key_use._MAX_WAITING",
        "service/middleware/compression._MIN_BYTES",
        "service/middleware/refusals._MAX_ADDRESSES",
        "service/middleware/refusals._MAX_TEXT",
        "service/server._MAX_OPEN_FILES",
        "spinewatch/imaging/bands._MIN_PERIOD_PX",
        "spinewatch/imaging/jpeg_stream._MIN_TESTED",
        "spinewatch/imaging/quality._MIN_SIDE_PX",
        "spinewatch/imaging/tone._MAX_DEFECT_SHARE",
        "spinewatch/imaging/tone._MIN_EXCESS_BITS",
        "workers/attempt._MIN_SECONDS_BETWEEN_WRITES",
        "workers/stage_labels._MIN_TRIADS",
        "workers/stage_measurers._MAX_RIGS",
    }
)
"""Constants that limit nothing that a client or an administrator meets: parameters of the method, and caches."""


def page(text: str) -> str:
    """Return the page with the limits as they are now."""
    before, rest = text.split(_FIRST, 1)
    _, after = rest.split(_LAST, 1)
    return f"{before}{_FIRST}\n{_tables()}{_LAST}{after}"


def missing() -> list[str]:
    """Return the constants that are neither on the page nor in ``NO_LIMITS``, and the names that are no constants."""
    listed = {f"{limit.module.replace('.', '/')}.{limit.name}" for _, limits in _TABLES for limit in limits}
    found = set(_constants())
    known = {name for name in listed if name.rpartition(".")[2].startswith(_NAMES)}
    lines = [
        f"{name} is a limit that docs/operations.md does not list"
        for name in sorted(found - listed - NO_LIMITS)
    ]
    return lines + [f"{name} is no constant" for name in sorted((known | NO_LIMITS) - found)]


def _constants() -> Iterator[str]:
    for room in _ROOMS:
        for path in sorted((PROJECT / room).rglob("*.py")):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
                for target in targets:
                    if isinstance(target, ast.Name) and target.id.isupper() and target.id.startswith(_NAMES):
                        yield f"{path.relative_to(PROJECT).with_suffix('').as_posix()}.{target.id}"


def _tables() -> str:
    parts = []
    for title, limits in _TABLES:
        rows = [f"| `{limit.name.lstrip('_')}` | {limit.value} | {limit.meaning} |" for limit in limits]
        heading = [title, ""] if title else []
        parts.append("\n".join([*heading, "| limit | value | meaning |", "|---|---|---|", *rows]) + "\n")
    return "\n".join(parts)


def main(arguments: Sequence[str]) -> int:
    """Write the limits, or return 1 when the page differs from the constants or a limit is on no page."""
    text = PAGE.read_text(encoding="utf-8")
    if "--write" in arguments:
        PAGE.write_text(page(text), encoding="utf-8")
        return 0
    lines = missing()
    if page(text) != text:
        lines.append("docs/operations.md differs from the limits; run: python -m checks.limits_page --write")
    sys.stderr.write("".join(f"{line}\n" for line in lines))
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
