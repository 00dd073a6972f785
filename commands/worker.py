"""``spinewatch worker``: one worker process."""

from __future__ import annotations

from datetime import timedelta
from functools import partial

import typer

from commands.shared.configuration import load_settings, require_record, start_log


def worker() -> None:
    """Measure submitted stages and calibrate, one job at a time; start as many as there are cores to spare."""
    settings = load_settings()
    require_record(settings)
    start_log(settings)
    from workers.carry_out import carry_out  # noqa: PLC0415 - loads OpenCV and SciPy
    from workers.process import run  # noqa: PLC0415

    max_age = timedelta(days=settings.calibration_max_age_days)
    raise typer.Exit(run(settings, partial(carry_out, max_calibration_age=max_age)))
