"""Exports are made in a process of its own with limits: a surgery of many stages takes minutes and gigabytes.

The process reads the summary of the surgery and answers with a line of JSON and the file.
"""

from __future__ import annotations

import gc
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import IO, Any

from contract.summary import SurgerySummary
from contract.text import STORED
from exports.formats import Export, export_surgery, file_name
from reports.pdf import to_pdf
from reports.surgery import render_surgery
from service.limited_process import (
    NoAnswerError,
    ProcessLimits,
    TooCostlyError,
    answer_of,
    serve,
    stored,
)
from spinewatch.errors import MissingPackageError, SpinewatchError

MAX_CPU_SECONDS = 60
"""CPU time for an export; 20 stages take 15 s as dicom-sr or report-pdf."""
MAX_MEMORY_BYTES = 1 << 30
"""Address space for an export; 20 stages take half of it as dicom-sr or report-pdf."""
MAX_SECONDS = 300.0
"""Time for an export, however busy the machine."""
EXPORT_LIMITS = ProcessLimits(MAX_CPU_SECONDS, MAX_MEMORY_BYTES, MAX_SECONDS)
"""What an export may take."""


class ExportTooCostlyError(SpinewatchError):
    """An export takes more time or memory than it may."""

    code = "export-too-costly"


class ExportFailedError(Exception):
    """The process of an export broke."""


class _PackageError(MissingPackageError):
    """A package is missing, in the words of the process."""

    def __init__(self, sentence: str) -> None:
        super(MissingPackageError, self).__init__(sentence)


@dataclass(frozen=True)
class ExportFile:
    """An export that is still on the disk.

    Attributes
    ----------
    file
        The content, from where it is read; gone when it is closed.
    size
        Bytes of the content.
    sha256
        Its hash.
    media_type
        Its media type.
    file_name
        A name for it, of ASCII letters, digits, dots and dashes.
    """

    file: IO[bytes]
    size: int
    sha256: str
    media_type: str
    file_name: str


def export_apart(
    summary: str, name: str, stage: str | None = None, limits: ProcessLimits = EXPORT_LIMITS
) -> ExportFile:
    """Return a surgery as a file, made in a process of its own.

    Parameters
    ----------
    summary
        The surgery, a ``SurgerySummary`` as JSON text.
    name
        Name of the format; report-html and report-pdf are the report.
    stage
        Name of a stage to export alone, for the formats that allow it; None for all.
    limits
        What the process may take.

    Returns
    -------
    ExportFile
        The file; it is to be closed.

    Raises
    ------
    SpinewatchError
        There is no such file, with the code of the reason.
    MissingPackageError
        The format needs a package that is not installed.
    ExportTooCostlyError
        The file takes more time or memory than it may.
    ExportFailedError
        The process broke.
    HTTPException
        503 when the machine is too busy or short of memory, 507 without room for the file.
    """
    arguments = [name] if stage is None else [name, stage]
    try:
        with stored([summary.encode()]) as source:
            answer = answer_of("service.export_process", arguments, source, limits)
    except TooCostlyError as error:
        raise ExportTooCostlyError(
            f"the surgery has too many stages for {name}, which takes too much time or memory; name one stage where the"
            " format allows it, or make the file with spinewatch export or spinewatch report, which have no limit"
        ) from error
    except NoAnswerError as error:
        raise ExportFailedError(f"the process that makes {name} broke; its error is in the log") from error
    found: dict[str, Any] = json.loads(answer.readline())
    if "code" in found:
        answer.close()
        raise _error(found["code"], found["detail"])
    return ExportFile(answer, **found)


def _error(code: str, detail: str) -> SpinewatchError:
    if code == MissingPackageError.code:
        return _PackageError(detail)
    error = SpinewatchError(detail)
    error.code = code
    return error


def _answer(data: bytes, arguments: Sequence[str]) -> Iterator[bytes]:
    """Return what the process answers: a line of JSON and the file, or the reason why there is none."""
    gc.disable()  # the process ends before it would pay
    try:
        made = _export(SurgerySummary.model_validate_json(data, context=STORED), *arguments)
    except SpinewatchError as error:
        yield json.dumps({"code": error.code, "detail": str(error)}).encode() + b"\n"
        return
    document = {
        "size": len(made.content),
        "sha256": sha256(made.content).hexdigest(),
        "media_type": made.media_type,
        "file_name": made.file_name,
    }
    yield json.dumps(document).encode() + b"\n"
    yield made.content


def _export(summary: SurgerySummary, name: str, stage: str | None = None) -> Export:
    if name not in {"report-html", "report-pdf"}:
        return export_surgery(summary, name, stage)
    page = render_surgery(summary)
    if name == "report-html":
        return Export(page.encode(), "text/html; charset=utf-8", file_name(summary, ".html"))
    return Export(to_pdf(page), "application/pdf", file_name(summary, ".pdf"))


if __name__ == "__main__":
    serve(_answer)
