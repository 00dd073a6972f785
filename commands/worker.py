"""``spinewatch worker``: one worker process."""

from __future__ import annotations

import typer

from commands.configuration import load_settings, require_record, start_log


def worker() -> None:
    """Measure submitted stages, one at a time; start as many as there are cores to spare."""
    settings = load_settings()
    require_record(settings)
    start_log(settings)
    from workers.measure import measure  # noqa: PLC0415 - loads OpenCV and SciPy
    from workers.process import run  # noqa: PLC0415

    raise typer.Exit(run(settings, measure))
