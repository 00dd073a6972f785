"""Known anomalies of the software that Spinewatch is made of, which concern it, and what it does about each.

IEC 62304 (5.3.3, 7.1.3) asks for this list. Each entry was seen with the version that it names: another version must
be examined before it is used. docs/anomalies.md is this list as a page.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class Anomaly:
    """A behaviour of a package that could harm: what happens, what that does, the measure, and the test of it."""

    package: str
    version: str
    behaviour: str
    effect: str
    measure: str
    test: str

    @property
    def identifier(self) -> str:
        """A name that is the same in every bill of materials of this version."""
        number = [other for other in ANOMALIES if other.package == self.package].index(self) + 1
        return f"SPINEWATCH-{self.package.upper()}-{number}"


ANOMALIES = (
    Anomaly(
        "huey",
        "3.5.4",
        "A message is deleted when a worker takes it: there is no acknowledgement.",
        "A worker that is killed would lose its job.",
        "The job's row under a lease decides; a sweep enqueues again what has stalled (store/leases.py,"
        " workers/sweep.py).",
        "tests/http/test_kill.py",
    ),
    Anomaly(
        "huey",
        "3.5.4",
        "Messages are pickled by default, and reading a pickle runs code from it.",
        "Whoever can write the queue could run code in a worker.",
        "Messages are JSON with the job's identifier only (store/queue.py).",
        "tests/store/test_queue.py",
    ),
    Anomaly(
        "huey",
        "3.5.4",
        "On PostgreSQL, tables are made without a lock, so that processes that start together fail; connections that"
        " listen are left open.",
        "A worker would not start, or use up connections.",
        "Processes take turns under an advisory lock, and poll instead of listening (store/queue.py).",
        "tests/store/test_queue.py",
    ),
    Anomaly(
        "opencv-python-headless",
        "4.14.0.94",
        "Its decoders rotate a TIFF by its orientation tag even when told not to, and read an 8-bit gray Sun raster"
        " without a colour map as black.",
        "A rotated image breaks a calibration silently; a black one has no balls.",
        "Files are decoded by Pillow and by the package's own reader of Sun rasters (spinewatch/imaging/decoding.py).",
        "tests/spinewatch/imaging/test_decoding.py",
    ),
    Anomaly(
        "pillow",
        "13.0.0",
        "A header may state any size and any number of pages or strips; above 89.5 million pixels it only warns.",
        "A small file could use all memory or time.",
        "The header is checked before decoding: format, size of the rig, one page (spinewatch/imaging/header.py);"
        " workers have a limit of memory and of time.",
        "tests/spinewatch/imaging/test_header.py",
    ),
    Anomaly(
        "sqlalchemy",
        "2.1.9",
        "A deferred SQLite transaction that reads before it writes fails under concurrency (250 of 300 with four"
        " workers).",
        "A result could not be stored.",
        "A transaction that writes takes the lock at its start, on SQLite and on PostgreSQL (store/database.py).",
        "tests/store/test_database.py",
    ),
    Anomaly(
        "fastapi",
        "0.165.0",
        "The default answer to an invalid request repeats its input, and fails with 500 for NaN and for a body without"
        " a media type.",
        "Case numbers would be written into logs of clients; an error would look like a defect.",
        "Errors are problem documents that repeat no input (service/problems.py).",
        "tests/http/test_problems.py",
    ),
    Anomaly(
        "uvicorn",
        "0.54.0",
        "An orderly stop waits for clients without end.",
        "A restart of the service would hang.",
        "Three seconds, then connections are closed (commands/serve.py).",
        "tests/http/test_run.py",
    ),
    Anomaly(
        "pyigtl",
        "0.3.4",
        "It has no TDATA messages.",
        "Tracking data could not be sent.",
        "A message class of our own (exports/openigtlink.py).",
        "tests/exports/test_openigtlink.py",
    ),
    Anomaly(
        "psycopg",
        "3.3.9",
        "Without limits, a connection to a server that was cut off waits until TCP gives up.",
        "Requests would hang instead of being answered with 503.",
        "Keep-alives and limits of time on both ends of each connection (store/postgresql.py).",
        "tests/store/test_postgresql.py",
    ),
)


def page() -> str:
    """Return docs/anomalies.md."""
    rows = [
        f"| `{a.package}` {a.version} | {a.behaviour} {a.effect} | {a.measure} | `{a.test}` |"
        for a in ANOMALIES
    ]
    return "\n".join([*_HEAD, *rows, ""])


_HEAD = (
    "# Known anomalies",
    "",
    "Behaviours of the packages that Spinewatch is made of which could harm, and what it does about each. Each was",
    "seen with the version that is named, and a test compares that with what is installed: another version must be",
    "examined first. The list is `commands/shared/anomalies.py`; `python -m commands.shared.anomalies` prints this",
    "page, and `spinewatch sbom` writes the list into the software bill of materials (CycloneDX), with versions and",
    "licences of everything that Spinewatch needs. `spinewatch sbom --known-anomalies` prints the same to read: the",
    "list that IEC 62304 (5.3.3, 7.1.3) asks for.",
    "",
    "| package | what happens | what Spinewatch does | shown by |",
    "|---|---|---|---|",
)

if __name__ == "__main__":
    sys.stdout.write(page())
