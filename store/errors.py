"""Named errors of the database and the queue; each message may be shown to users unchanged."""

from __future__ import annotations

from spinewatch.errors import SpinewatchError


class NotFoundError(SpinewatchError):
    """The database has nothing under this identifier.

    Parameters
    ----------
    kind
        What was looked for: surgery, stage, job ...
    """

    code = "not-found"

    def __init__(self, kind: str) -> None:
        super().__init__(f"there is no such {kind}; take the identifier from the list of all")
        self.code = f"{kind}-not-found"


class ReportNotFoundError(NotFoundError):
    """The calibration was given as a rig, so that it has no report."""

    def __init__(self) -> None:
        super().__init__("report")
        self.args = ("this calibration was given as a rig; only one made from images here has a report",)


class ConflictError(SpinewatchError):
    """The request contradicts the contents of the database."""

    code = "conflict"


class StageExistsError(ConflictError):
    """The surgery has a stage of this name, and its job did not fail."""

    code = "stage-exists"


class StageNotMeasuredError(ConflictError):
    """The stage's job has not succeeded, so that there is no result."""

    code = "stage-not-measured"


class JobFinishedError(ConflictError):
    """The job has ended and cannot be cancelled."""

    code = "job-finished"


class DatabaseNotReadyError(SpinewatchError):
    """The database is missing or its tables are not those of this version."""

    code = "database-not-ready"


class QueueURLError(SpinewatchError):
    """The queue's URL cannot be used."""

    code = "invalid-queue-url"
