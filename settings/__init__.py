"""All settings, read once at the edge (docs/operations.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict
from sqlalchemy.engine import make_url

_MIB = 1024 * 1024


class Settings(BaseSettings):
    """The settings of every process; each field is an environment variable with the prefix SPINEWATCH_."""

    model_config = SettingsConfigDict(env_prefix="SPINEWATCH_", frozen=True, extra="forbid")

    database_url: Annotated[str, Field(description="The database, as an SQLAlchemy URL.")] = (
        "sqlite:///var/spinewatch.sqlite"
    )
    queue_url: Annotated[
        str | None,
        Field(
            description="The queue: sqlite:///FILE, redis:// or postgresql://; by default a file beside the database."
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
    max_upload_bytes: Annotated[int, Field(ge=1024, description="Largest request body, bytes.")] = 32 * _MIB
    worker_memory_bytes: Annotated[
        int, Field(ge=1024 * _MIB, description="Largest address space of a worker process, bytes.")
    ] = 4096 * _MIB
    lease_seconds: Annotated[
        float, Field(ge=1, le=300, description="Time without a heartbeat after which a worker loses its job.")
    ] = 5.0
    max_run_seconds: Annotated[
        float, Field(ge=1, description="Time after which a running job is ended with its worker process.")
    ] = 120.0
    max_attempts: Annotated[int, Field(ge=1, le=100, description="Number of attempts per job.")] = 3
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

    @property
    def queue(self) -> str:
        """URL of the queue: ``queue_url``, or an SQLite file beside the database."""
        if self.queue_url is not None:
            return self.queue_url
        database = make_url(self.database_url)
        if database.get_backend_name() != "sqlite" or not database.database:
            return "sqlite:///var/spinewatch-queue.sqlite"
        file = Path(database.database)
        return f"sqlite:///{file.with_name(f'{file.stem}-queue.sqlite')}"

    def environment(self) -> dict[str, str]:
        """Return these settings as environment variables for a child process."""
        values = self.model_dump(mode="json", exclude_none=True)
        return {f"SPINEWATCH_{key.upper()}": str(value) for key, value in values.items()}
