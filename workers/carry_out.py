"""What is done for a job, by what it is to make."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

from spinewatch.progress import Progress
from store.calibration_requests import CalibrationWork
from store.work import Work
from workers.calibrate import calibrate
from workers.measure import measure


def carry_out(work: Work, progress: Progress, max_calibration_age: timedelta) -> dict[str, Any]:
    """Return the document that the work ends with; raise a ``SpinewatchError`` for what cannot be done."""
    if isinstance(work, CalibrationWork):
        return calibrate(work, progress)
    return measure(work, progress, max_calibration_age)
