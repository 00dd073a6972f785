"""Health of a server: whether it lives, and whether it is ready for work."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from contract.base import Schema
from contract.problem import Problem

Instance = Annotated[
    str, Field(description="Name of this run of the server (SPINEWATCH_INSTANCE_ID), else random.")
]
Version = Annotated[str, Field(description="Version of Spinewatch.")]


class Health(Schema):
    """The server runs; with an API key also that its database is available and has the tables of this version."""

    status: Annotated[
        Literal["live", "ready"],
        Field(description="Ready with an API key, else live; otherwise the answer is a problem."),
    ]
    version: Version
    revision: Annotated[
        str | None, Field(description="Revision of the database's tables; null without an API key.")
    ] = None


class Liveness(Schema):
    """The server answers requests; nothing else was asked."""

    status: Annotated[Literal["live"], Field(description="Always live.")]
    instance: Instance
    version: Version


class HealthCheck(Schema):
    """One thing that the server needs for its work."""

    name: Annotated[
        Literal["database", "disk", "temporary-files", "queue", "queue-age", "workers"],
        Field(description="What was checked."),
    ]
    ok: Annotated[bool, Field(description="Whether it permits work.")]
    figure: Annotated[float | None, Field(description="What was measured; null when it could not be.")]
    limit: Annotated[
        float | None, Field(description="Least or largest figure that permits work; null when there is none.")
    ]
    unit: Annotated[
        str, Field(description="Unit of both, in UCUM: s for seconds, By for bytes, 1 for a number.")
    ]
    detail: Annotated[str, Field(description="What was found and what to do, for people.")]


class Readiness(Schema):
    """The server and its workers can measure stages now."""

    status: Annotated[Literal["ready"], Field(description="Always ready; otherwise the answer is a problem.")]
    instance: Instance
    version: Version
    revision: Annotated[str, Field(description="Revision of the database's tables.")]
    checks: Annotated[list[HealthCheck], Field(description="Every check, all of which are ok.")]


class NotReady(Problem):
    """The server cannot do its work now; ``checks`` has the reason."""

    checks: Annotated[
        list[HealthCheck], Field(description="Every check; those that are not ok are the reason.")
    ]
