"""Jobs that measure a stage of a surgery."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from datetime import datetime, timedelta
from functools import lru_cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, cast

from sqlalchemy.orm import Session

import spinewatch.flags
from contract.event import Actor
from contract.flag import Flag
from contract.revision import Remeasurement, TriadEdits
from contract.stage import StageResult
from settings import Settings
from spinewatch.camera import Rig
from spinewatch.detection.candidates.templates import (
    TemplateError,
    TemplateSet,
    default_template_set,
    read_template_set,
)
from spinewatch.imaging.comparison import ComparisonParameters
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame, Side
from spinewatch.pipeline import Parameters, StageMeasurer, StageRequest
from spinewatch.progress import Progress, part
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.rig_plausibility import check_measurable_rig
from spinewatch.tracking.synchronization import SynchronizationParameters, delay_flags, parallax_gain
from store import measurements, spines, stage_work
from store.jobs import Lease
from store.stage_work import PairWork, StageWork
from store.tables import STAGE_JOB
from workers.record_checks import burst_repetition_flags, repetition_flags, time_flags
from workers.registry import Handler
from workers.stage_burst import burst_result, view_delay_s
from workers.stage_labels import label_pairs
from workers.stage_revision import chosen_templates, edited, revised_parameters

_VERSION = version("spinewatch")
_DAY = timedelta(days=1)
_MAX_RIGS = 8
"""Measurers that a worker keeps prepared, one per rig."""
_COMPARED_STAGES = 4
"""Number of the latest earlier stages whose gray levels a stage is compared with."""


class StageHandler(Handler[StageWork, StageResult]):
    """Measures the stereo pair of a stage, or the pairs of its burst.

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
        self._synchronization = SynchronizationParameters()
        pool = ThreadPoolExecutor(max_workers=1)

        @lru_cache(maxsize=_MAX_RIGS)
        def measurer(rig_json: str, changes_json: str = "{}", version: str | None = None) -> StageMeasurer:
            changes = json.loads(changes_json)
            used = revised_parameters(parameters or Parameters(), changes) if changes else parameters
            rig = parse_rig(rig_json)
            if (used or Parameters()).search.matching.epipolar.range_mm is None:
                check_measurable_rig(rig)
            return StageMeasurer(rig, used, chosen_templates(version, templates), pool)

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
        return stage_work.work(session, lease.subject_id, _COMPARED_STAGES)

    def run(self, work: StageWork, progress: Progress) -> StageResult:
        """Return what is measured in the stereo pair, or in the pairs of a burst; or the edited result of a revision.

        Parameters
        ----------
        work
            The images, rig and labels.
        progress
            Called at the start of each step.

        Returns
        -------
        StageResult
            The result, with flags of the calibration's age, of implausible times, of repeated images and of views that
            were not exposed together.

        Raises
        ------
        SpinewatchError
            The images cannot be measured.
        NotReadyError
            Labels depend on an earlier stage whose job has not ended.
        """
        revision = work.revision
        if revision is not None and isinstance(revision.changes, TriadEdits):
            return edited(revision.revised, revision.changes, work.vertebrae)
        axis = cast(Literal["x", "y", "auto"], work.spine_axis)
        request = StageRequest(labels=work.vertebrae, spine_axis=axis, extra_levels=work.extra_levels)
        measurer = self._measurer_for(work)
        first, *further = work.pairs
        progress("decode", 0.0)
        frames = _frames(first)
        measured = [measurer.measure(*frames, request, _of_pair(progress, 0, len(work.pairs)))]
        digests = [_digests(frames)] if further else []
        for index, pair in enumerate(further, start=1):
            others = _frames(pair)
            digests.append(_digests(others))
            measured.append(measurer.measure(*others, request, _of_pair(progress, index, len(work.pairs))))
        labelled = label_pairs(measured, request, work)
        made = _VERSION, self._settings()
        if further:
            result = burst_result(work.pairs, labelled, request.labels, work.reference_vertebra, made)
        else:
            result = StageResult.of(labelled[0].measurement, *made).model_copy(
                update={"view_delay_s": view_delay_s(first), "labelled_by": labelled[0].labelled_by}
            )
        pixels = {frame.side: frame.pixels for frame in frames}
        record = [
            *time_flags(work, self._clock_tolerance),
            *repetition_flags(work, pixels, self._comparison),
            *burst_repetition_flags(digests),
            *self._delay_flags(work, measurer.rig),
        ]
        flags = [*result.flags, *self._age_flags(work.calibration_age / _DAY), *Flag.of(record)]
        return result.model_copy(update={"flags": flags})

    def store(
        self, session: Session, lease: Lease, result: StageResult, now: datetime, actor: Actor
    ) -> tuple[str, ...]:
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

        Returns
        -------
        tuple of str
            The job that computes the spines of the surgery, if it has a setup.
        """
        measurements.add(session, lease.subject_id, result, now, actor)
        job_id = None if lease.surgery_id is None else spines.submit(session, lease.surgery_id, now)
        return () if job_id is None else (job_id,)

    def _measurer_for(self, work: StageWork) -> StageMeasurer:
        rig_json = json.dumps(work.rig)
        changes = None if work.revision is None else work.revision.changes
        if not isinstance(changes, Remeasurement):
            return self._measurer(rig_json)
        return self._measurer(rig_json, json.dumps(changes.parameters, sort_keys=True), changes.templates)

    def _settings(self) -> dict[str, Any]:
        return {
            "calibration_max_age_days": self._max_age_days,
            "clock_tolerance_seconds": self._clock_tolerance.total_seconds(),
            "comparison": asdict(self._comparison),
            "synchronization": asdict(self._synchronization),
        }

    def _delay_flags(self, work: StageWork, rig: Rig) -> tuple[spinewatch.flags.Flag, ...]:
        delays = [delay for delay in map(view_delay_s, work.pairs) if delay is not None]
        return delay_flags(delays, parallax_gain(rig), self._synchronization) if delays else ()

    def _age_flags(self, days: float) -> list[Flag]:
        if days <= self._max_age_days:
            return []
        detail = (
            f"the calibration was {days:.1f} days old when the stage was taken, and at most {self._max_age_days:g} are"
            " allowed; calibrate before the operation"
        )
        return Flag.of([spinewatch.flags.Flag("calibration-old", detail)])


def _frames(pair: PairWork) -> tuple[Frame, Frame]:
    """Return both images of a pair."""
    return Frame(decode_image(pair.left), "left"), Frame(decode_image(pair.right), "right")


def _digests(frames: tuple[Frame, Frame]) -> dict[Side, str]:
    """Return digests of the gray levels of both images."""
    return {frame.side: sha256(frame.pixels.tobytes()).hexdigest() for frame in frames}


def _of_pair(progress: Progress, index: int, n: int) -> Progress:
    """Return the progress of one of n pairs."""
    if n == 1:
        return progress
    share = part(progress, index / n, (index + 1) / n)
    return lambda step, fraction: share(f"pair {index + 1} of {n}: {step}", fraction)


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
