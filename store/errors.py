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
    """The surgery has a stage of this name, and its job did not fail.

    Parameters
    ----------
    message
        What is wrong and what to do.
    job_id
        The job of the stage that is there.
    """

    code = "stage-exists"

    def __init__(self, message: str, job_id: str | None = None) -> None:
        super().__init__(message)
        self.job_id = job_id


class StageNameSimilarError(ConflictError):
    """The name of a new stage differs from that of another one in upper and lower case only."""

    code = "stage-name-similar"


class TakeSupersededError(ConflictError):
    """The results of another take of the stage count."""

    code = "take-superseded"


class StageNotMeasuredError(ConflictError):
    """The stage's job has not succeeded, so that there is no result."""

    code = "stage-not-measured"


class FeaturesMissingError(ConflictError):
    """The features of a pair of a burst were not kept.

    Parameters
    ----------
    pair
        Number of the pair, from 1.
    """

    code = "features-missing"

    def __init__(self, pair: int) -> None:
        super().__init__(
            f"the features of pair {pair} were not kept by the version that measured it; measure the stage again, with"
            " a revision of the kind measure"
        )


class SetupMissingError(ConflictError):
    """The surgery has no setup of the spine, so that nothing but the motion of its triads can be reported."""

    code = "spine-setup-missing"

    def __init__(self) -> None:
        super().__init__(
            "this surgery has no setup of the spine, so that only the motion of its triads is known; PUT one to"
            " /v1/surgeries/{surgery_id}/spine"
        )


class SpineNotReadyError(ConflictError):
    """The spine of a stage is not computed yet."""

    code = "spine-not-ready"


class SpineNotAvailableError(ConflictError):
    """A stage has no spine, and its inputs as they are give none."""

    code = "spine-not-available"


class RebaselineExistsError(ConflictError):
    """The marker was stored as clamped again before the same stage already."""

    code = "rebaseline-exists"


class JobFinishedError(ConflictError):
    """The job has ended and cannot be cancelled."""

    code = "job-finished"


class DatabaseNotReadyError(SpinewatchError):
    """The database is missing or its tables are not those of this version."""

    code = "database-not-ready"


class QueueURLError(SpinewatchError):
    """The queue's URL cannot be used."""

    code = "invalid-queue-url"


class BackupError(SpinewatchError):
    """A backup cannot be made or restored."""

    code = "backup"


class ExportFileError(SpinewatchError):
    """A file cannot be written."""

    code = "export-file"


class AuditFileError(SpinewatchError):
    """A file has no audit that can be read."""

    code = "audit-file"


class ImageDamagedError(SpinewatchError):
    """A stored image differs from its SHA-256."""

    code = "image-damaged"


class SurgeryDeletedError(SpinewatchError):
    """The surgery was deleted."""

    code = "surgery-deleted"
