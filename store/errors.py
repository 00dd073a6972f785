"""Named errors of the record; a caller may show each message to a person as it stands."""

from __future__ import annotations

from spinewatch.errors import SpinewatchError


class NotFoundError(SpinewatchError):
    """The record has nothing under this identifier."""

    code = "not-found"

    def __init__(self, kind: str) -> None:
        super().__init__(f"there is no such {kind}; list what there is and take the identifier from there")
        self.code = f"{kind}-not-found"


class ReportNotFoundError(NotFoundError):
    """The calibration was given as a rig, so that nothing is known of how it was made."""

    def __init__(self) -> None:
        super().__init__("report")
        self.args = ("this calibration was given as a rig; only one made from pictures here has a report",)


class ConflictError(SpinewatchError):
    """The request contradicts what the record already holds."""

    code = "conflict"


class StageExistsError(ConflictError):
    """The surgery has a stage of this name, and its job did not fail."""

    code = "stage-exists"


class StageNotMeasuredError(ConflictError):
    """The stage's job has not succeeded, so that there is no result to show."""

    code = "stage-not-measured"


class JobFinishedError(ConflictError):
    """The job has ended and cannot be cancelled any more."""

    code = "job-finished"


class DatabaseNotReadyError(SpinewatchError):
    """The database is missing or its tables are not those of this version."""

    code = "record-not-ready"
