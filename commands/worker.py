"""``spinewatch worker``: one worker process."""

from __future__ import annotations

import typer

from commands.shared.configuration import load_settings, require_database, require_queue, start_log
from commands.shared.loading import loading
from commands.shared.watchdog import notifier


def worker() -> None:
    """Run queued jobs, one at a time; start about one worker per CPU core."""
    with loading():
        settings = load_settings()
        require_database(settings)
        require_queue(settings)
        start_log(settings)
        from workers.process import run  # noqa: PLC0415 - loads OpenCV and SciPy
        from workers.registry import discover  # noqa: PLC0415

        registry = discover(settings)
    raise typer.Exit(run(settings, registry, notifier()))
