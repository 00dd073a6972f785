"""DICOM structured report (TID 1500, Measurement Report) of a surgery; highdicom is an extra."""

from __future__ import annotations

from contract.summary import SurgerySummary
from spinewatch.errors import MissingPackageError, SpinewatchError

MEDIA_TYPE = "application/dicom"
FILE_SUFFIX = ".dcm"


class NothingToReportError(SpinewatchError):
    """A surgery without a stage has nothing to report."""

    code = "nothing-to-report"


def export(summary: SurgerySummary) -> bytes:
    """Return the structured report of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.

    Returns
    -------
    bytes
        A DICOM file, Comprehensive SR. The same summary gives the same bytes. It names no person: Patient ID is the
        case number (the surgery's identifier where the case number is no valid Patient ID). Values that were not
        measured are evaluations with a reason, not numbers.

    Raises
    ------
    MissingPackageError
        If highdicom is not installed.
    NothingToReportError
        If the surgery has no stage.
    """
    try:
        from exports import sr_document  # noqa: PLC0415 - it needs an optional package
    except ModuleNotFoundError as error:
        if error.name != "highdicom":
            raise
        raise MissingPackageError("The DICOM export", "highdicom", "pip install spinewatch[dicom]") from error
    if not summary.stages:
        raise NothingToReportError("the surgery has no stage; measure one before exporting it")
    return sr_document.write(summary)
