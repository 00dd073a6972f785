"""All settings, read once at the edge (docs/operations.md)."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

from settings import values
from settings.patterns import LinearPattern, TextPattern

PREFIX = "SPINEWATCH_"
"""The beginning of every environment variable that is a setting."""

_CLIENT_VARIABLES = frozenset({"KEY"})
"""Variables with the prefix that commands read which ask a service, and that are no settings of it."""

_PART = (
    r"(?>[A-Za-z]{0,3}[0-9]++(?:[A-Za-z]{1,3}[0-9]++)*+[A-Za-z]{0,3}+(?![A-Za-z0-9])"
    r"|(?=[a-f]*+[0-9])[0-9a-f]{4,32}+(?![A-Za-z0-9])|(?=[A-F]*+[0-9])[0-9A-F]{4,32}+(?![A-Za-z0-9]))"
)
OPAQUE_REFERENCE = (
    rf"(?:(?i:case|fall|op|sample|study|test|trial)[ ._/-]?|[A-Za-z]{{1,3}}[ ._/-])?{_PART}(?:[ ._/-]{_PART})*"
    r"|[0-9a-fA-F]{8}-(?:[0-9a-fA-F]{4}-){3}[0-9a-fA-F]{12}"
)
"""Case numbers that are accepted unless a site sets its own pattern.

Parts with digits, separated by space, dot, dash, slash or underscore; letters stand between digits three at a time, and
one word of up to three letters, or one that says what is counted, may come first. So 2026-0417, OP 17, case 17,
SAMPLE-D1, KH.26/0417b and UUIDs pass; a name of four letters or more never does, nor do two words.
"""

_MIB = 1024 * 1024
_TIB = _MIB << 20
_DAY = 86400


def _file_of(url: str) -> Path | None:
    """Return the file of an SQLite URL, None for any other URL and for what is none."""
    try:
        parsed = make_url(url)
        is_file = parsed.get_backend_name() == "sqlite" and parsed.database not in {None, "", ":memory:"}
    except (ArgumentError, ValueError):
        return None
    return Path(parsed.database or "") if is_file else None


def _is_same_file(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one file, which need not exist."""
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return os.path.realpath(one) == os.path.realpath(other)


def unknown_variables(names: Iterable[str]) -> dict[str, str | None]:
    """Return the environment variables with the prefix that are no setting, each with the setting nearest to it."""
    known = [field.upper() for field in Settings.model_fields]
    given = ((name, name.upper().removeprefix(PREFIX)) for name in sorted(names))
    unknown = [
        (name, key) for name, key in given if key != name.upper() and key not in {*known, *_CLIENT_VARIABLES}
    ]
    nearest = ((name, get_close_matches(key, known, n=1)) for name, key in unknown)
    return {name: f"{PREFIX}{found[0]}" if found else None for name, found in nearest}


class Settings(BaseSettings):
    """The settings of every process; each field is an environment variable with the prefix SPINEWATCH_."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, frozen=True, extra="forbid")

    database_url: Annotated[
        str,
        AfterValidator(values.database_url),
        Field(description="The database, as an SQLAlchemy URL."),
    ] = "sqlite:///var/spinewatch.sqlite"
    queue_url: Annotated[
        Annotated[str, AfterValidator(values.queue_url)] | None,
        Field(
            description="The queue: sqlite:///FILE, redis:// or postgresql://; by default a file beside an SQLite"
            " database, or the PostgreSQL database itself."
        ),
    ] = None
    templates: Annotated[
        Path | None,
        Field(description="File of the template set to detect with; by default the one included."),
    ] = None
    host: Annotated[str, Field(description="Address to listen on.")] = "127.0.0.1"
    port: Annotated[int, Field(ge=1, le=65535, description="Port to listen on.")] = 8000
    workers: Annotated[
        int, Field(ge=1, le=64, description="Number of worker processes of `spinewatch run`.")
    ] = 2
    max_upload_bytes: Annotated[
        int, Field(ge=1024, le=4096 * _MIB, description="Largest body of a request with images, bytes.")
    ] = 32 * _MIB
    max_document_bytes: Annotated[
        int,
        Field(ge=1024, le=64 * _MIB, description="Largest body of a request with a rig or a spine, bytes."),
    ] = 256 * 1024
    max_json_bytes: Annotated[
        int, Field(ge=1024, le=64 * _MIB, description="Largest body of any other request, bytes.")
    ] = 64 * 1024
    max_connections: Annotated[
        int,
        Field(
            ge=8, le=100_000, description="Open connections; beyond it the one that waits longest is closed."
        ),
    ] = 1000
    header_timeout_seconds: Annotated[
        float, Field(ge=0.1, le=300, description="Time for the request line and headers to arrive.")
    ] = 10.0
    body_timeout_seconds: Annotated[
        float,
        Field(
            ge=0.1, le=3600, description="Time for a body to arrive, and a second more for every 16 kB of it."
        ),
    ] = 20.0
    idle_timeout_seconds: Annotated[
        float, Field(ge=1, le=3600, description="Time after which a connection without a request is closed.")
    ] = 30.0
    write_timeout_seconds: Annotated[
        float,
        Field(ge=0.1, le=3600, description="Time after which a client that reads nothing is disconnected."),
    ] = 30.0
    stream_seconds: Annotated[
        float,
        Field(
            ge=0.1,
            le=86400,
            description="Time after which a stream of events ends; its client takes it up where it ended.",
        ),
    ] = 3600.0
    allowed_hosts: Annotated[
        Annotated[str, AfterValidator(values.host_names)] | None,
        Field(description="Further names of the service in the Host header, separated by commas."),
    ] = None
    allowed_origins: Annotated[
        Annotated[str, AfterValidator(values.origins)] | None,
        Field(
            description="Origins whose pages may use the API, such as https://dashboard.example, by commas."
        ),
    ] = None
    tls_cert: Annotated[
        Path | None, Field(description="File of the TLS certificate, PEM, with those that it depends on.")
    ] = None
    tls_key: Annotated[
        Path | None, Field(description="File of the private key of the TLS certificate, PEM.")
    ] = None
    behind_proxy: Annotated[
        bool, Field(description="A proxy that ends TLS forwards to this service; no other way leads to it.")
    ] = False
    trusted_proxies: Annotated[
        str,
        AfterValidator(values.proxies),
        Field(
            description="Addresses or networks of proxies whose X-Forwarded-For and X-Forwarded-Proto count,"
            " separated by commas; used with `behind_proxy`."
        ),
    ] = "127.0.0.1"
    session_hours: Annotated[
        float,
        Field(gt=0, le=168, description="Time after which a browser has to be given the API key again."),
    ] = 12.0
    worker_memory_bytes: Annotated[
        int,
        Field(
            ge=1024 * _MIB, le=_TIB << 4, description="Largest address space of the process of a job, bytes."
        ),
    ] = 4096 * _MIB
    lease_seconds: Annotated[
        float, Field(ge=1, le=300, description="Time without a heartbeat after which a worker loses its job.")
    ] = 5.0
    max_run_seconds: Annotated[
        float, Field(ge=1, le=_DAY, description="Time after which a running job is ended and fails.")
    ] = 300.0
    max_cpu_seconds: Annotated[
        float, Field(ge=1, le=_DAY, description="CPU time after which a running job is ended and fails.")
    ] = 120.0
    watchdog_seconds: Annotated[
        float,
        Field(ge=2, le=3600, description="Time without a sign of life after which `run` ends a process."),
    ] = 20.0
    max_attempts: Annotated[int, Field(ge=1, le=100, description="Number of attempts per job.")] = 3
    min_free_bytes: Annotated[
        int,
        Field(
            ge=0,
            le=_TIB << 10,
            description="Free space of the database's disk below which the service is not ready.",
        ),
    ] = 1024 * _MIB
    max_queue_seconds: Annotated[
        float,
        Field(
            ge=1, le=_DAY, description="Age of the oldest queued job above which the service is not ready."
        ),
    ] = 120.0
    instance_id: Annotated[
        str | None,
        Field(
            pattern=r"^[A-Za-z0-9_-]{1,64}$",
            description="Name of this server in /health/live; random by default.",
        ),
    ] = None
    reference_pattern: Annotated[
        Annotated[str, AfterValidator(values.pattern)] | None,
        Field(
            description="Regular expression that a case number must match as a whole, without look-around and"
            " back-references; by default numbers, no names."
        ),
    ] = None
    calibration_max_age_days: Annotated[
        float, Field(gt=0, le=3650, description="A stage measured with an older calibration is flagged.")
    ] = 1.0
    clock_tolerance_seconds: Annotated[
        float,
        Field(
            ge=0,
            le=86400,
            description="Largest difference between the clocks of cart and service; times beyond it are implausible.",
        ),
    ] = 300.0
    log_format: Annotated[Literal["text", "json"], Field(description="Format of the log on stderr.")] = "text"
    log_level: Annotated[
        Literal["debug", "info", "warning", "error"], Field(description="Lowest level that is logged.")
    ] = "info"

    @field_validator("queue_url")
    @classmethod
    def _is_not_the_database(cls, queue_url: str | None, info: ValidationInfo) -> str | None:
        """Raise ``ValueError`` if the queue is the database's file, or one that SQLite keeps beside it."""
        database, queue = _file_of(info.data.get("database_url", "")), _file_of(queue_url or "")
        if database is None or queue is None:
            return queue_url
        for ending in ("", "-wal", "-shm", "-journal"):
            if _is_same_file(database.with_name(database.name + ending), queue):
                raise ValueError(f"{queue} belongs to the database; give the queue a file of its own")
        return queue_url

    @property
    def case_number(self) -> TextPattern:
        """What a case number must match: ``reference_pattern``, or ``OPAQUE_REFERENCE``."""
        if self.reference_pattern is None:
            return re.compile(OPAQUE_REFERENCE)
        return LinearPattern(self.reference_pattern)

    @property
    def queue(self) -> str:
        """URL of the queue: ``queue_url``, or a file beside an SQLite database, or the PostgreSQL database itself."""
        if self.queue_url is not None:
            return self.queue_url
        database = make_url(self.database_url)
        if database.get_backend_name() == "postgresql":
            return self.database_url
        if database.get_backend_name() != "sqlite" or not database.database:
            return "sqlite:///var/spinewatch-queue.sqlite"
        file = Path(database.database)
        return f"sqlite:///{file.with_name(f'{file.stem}-queue.sqlite')}"

    def listed(self, name: Literal["allowed_hosts", "allowed_origins"]) -> list[str]:
        """Return the entries of a setting that is a list separated by commas."""
        text: str | None = getattr(self, name)
        return values.entries(text or "")

    def environment(self) -> dict[str, str]:
        """Return these settings as environment variables for a child process."""
        values = self.model_dump(mode="json", exclude_none=True)
        return {f"{PREFIX}{key.upper()}": str(value) for key, value in values.items()}
