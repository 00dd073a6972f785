"""The surgery that a command is about: of a running service, or in a file."""

from __future__ import annotations

from pathlib import Path

from commands.shared.summary_source import FileSource, ServiceSource, SummarySource
from contract.summary import SurgerySummary
from spinewatch.errors import ParameterError


def read_summary(surgery: str | None, file: Path | None, url: str, key: str | None = None) -> SurgerySummary:
    """Return the summary of a surgery; raises a ``SpinewatchError`` when it cannot be had."""
    if (surgery is None) == (file is None):
        raise ParameterError("name either a surgery of a service or a file with its summary (--file)")
    source: SummarySource
    source = FileSource(file) if file is not None else ServiceSource(url, surgery or "", key=key)
    summary = source.changed()
    assert summary is not None  # noqa: S101 - the first call always gives one
    return summary
