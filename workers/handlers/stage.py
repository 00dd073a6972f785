"""Jobs that measure a stage of a surgery."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from datetime import datetime, timedelta
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, cast

from sqlalchemy.orm import Session

import spinewatch.flags
from contract.event import Actor
from contract.flag import Flag
from contract.stage import StageResult
from settings import Settings
from spinewatch.detection.candidates.templates import (
    TemplateError,
    TemplateSet,
    default_template_set,
    read_template_set,
)
from spinewatch.imaging.comparison import ComparisonParameters
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.pipeline import Parameters, StageMeasurer, StageRequest
from spinewatch.progress import Progress
from spinewatch.rig_files.rig_json import parse_rig
from store import measurements, stages
from store.jobs import Lease
from store.stages import StageWork
from store.tables import STAGE_JOB
from workers.record_checks import repetition_flags, time_flags
from workers.registry import Handler

_VERSION = version("spinewatch")
_DAY = timedelta(days=1)
_MAX_RIGS = 8
"""Measurers that a worker keeps prepared, one per rig."""
_COMPARED_STAGES = 4
"""Number of the latest earlier stages whose gray levels a stage is compared with."""


class StageHandler(Handler[StageWork, StageResult]):
    """Measures the stereo pair of a stage.

    Parameters
    ----------
    templates
        Template set to detect with.
    max_calibration_age
        A stage measured with an older calibration is flagged.
    clock_tolerance
        Largest difference between the clocks that gave the times of stages and calibrations.
    parameters
        Parameters of the method.
    """

    kind = STAGE_JOB

    def __init__(
        self,
        templates: TemplateSet,
        max_calibration_age: timedelta,
        clock_tolerance: timedelta,
        parameters: Parameters | None = None,
    ) -> None:
        self._max_age_days = max_calibration_age / _DAY
        self._clock_tolerance = clock_tolerance
        self._comparison = ComparisonParameters()
        pool = ThreadPoolExecutor(max_workers=1)

        @lru_cache(maxsize=_MAX_RIGS)
        def measurer(rig_json: str) -> StageMeasurer:
            return StageMeasurer(parse_rig(rig_json), parameters, templates, pool)

        self._measurer = measurer

    def load(self, session: Session, lease: Lease) -> StageWork:
        """Return the images, rig and labels of the stage.

        Parameters
        ----------
        session
            Session that reads.
        lease
            The lease on the stage.

        Returns
        -------
        StageWork
            The input.
        """
        return stages.work(session, lease.subject_id, _COMPARED_STAGES)

    def run(self, work: StageWork, progress: Progress) -> StageResult:
        """Return what is measured in the stereo pair.

        Parameters
        ----------
        work
            The images, rig and labels.
        progress
            Called at the start of each step.

        Returns
        -------
        StageResult
            The result, with flags of the calibration's age, of implausible times and of repeated images.

        Raises
        ------
        SpinewatchError
            The images cannot be measured.
        """
        progress("decode", 0.0)
        left, right = Frame(decode_image(work.left), "left"), Frame(decode_image(work.right), "right")
        axis = cast(Literal["x", "y", "auto"], work.spine_axis)
        request = StageRequest(labels=work.vertebrae, spine_axis=axis, extra_levels=work.extra_levels)
        measured = self._measurer(json.dumps(work.rig)).measure(left, right, request, progress)
        result = StageResult.of(measured, _VERSION, self._settings())
        pixels = {left.side: left.pixels, right.side: right.pixels}
        record = [*time_flags(work, self._clock_tolerance), *repetition_flags(work, pixels, self._comparison)]
        flags = [*result.flags, *self._age_flags(work.calibration_age / _DAY), *Flag.of(record)]
        return result.model_copy(update={"flags": flags})

    def store(self, session: Session, lease: Lease, result: StageResult, now: datetime, actor: Actor) -> None:
        """Add the measurement of the stage.

        Parameters
        ----------
        session
            Session that writes.
        lease
            The lease on the stage.
        result
            What was measured.
        now
            Time of the result.
        actor
            The worker.
        """
        measurements.add(session, lease.subject_id, result, now, actor)

    def _settings(self) -> dict[str, Any]:
        return {
            "calibration_max_age_days": self._max_age_days,
            "clock_tolerance_seconds": self._clock_tolerance.total_seconds(),
            "comparison": asdict(self._comparison),
        }

    def _age_flags(self, days: float) -> list[Flag]:
        if days <= self._max_age_days:
            return []
        detail = (
            f"the calibration was {days:.1f} days old when the stage was taken, and at most {self._max_age_days:g} are"
            " allowed; calibrate before the operation"
        )
        return Flag.of([spinewatch.flags.Flag("calibration-old", detail)])


def handler(settings: Settings) -> StageHandler:
    """Return the handler of jobs that measure a stage.

    Parameters
    ----------
    settings
        The template set, the largest age of a calibration and the tolerance of clocks.

    Returns
    -------
    StageHandler
        The handler.

    Raises
    ------
    TemplateError
        The file of the template set cannot be read, or is none.
    """
    tolerance = timedelta(seconds=settings.clock_tolerance_seconds)
    return StageHandler(_templates(settings.templates), settings.calibration_max_age_days * _DAY, tolerance)


def _templates(file: Path | None) -> TemplateSet:
    if file is None:
        return default_template_set()
    try:
        return read_template_set(file.read_bytes())
    except OSError as error:
        raise TemplateError(f"cannot read {file}: {error.strerror}; set SPINEWATCH_TEMPLATES") from error
