"""Jobs that measure a stage of a surgery."""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from datetime import datetime, timedelta
from functools import lru_cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, cast

from pydantic_core import to_jsonable_python
from sqlalchemy.orm import Session

import spinewatch.flags
from contract.event import Actor
from contract.flag import Flag
from contract.revision import Remeasurement, TriadEdits
from contract.stage import StageResult
from settings import Settings
from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.detection.candidates.templates import (
    TemplateError,
    TemplateSet,
    default_template_set,
    read_template_set,
)
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.imaging.comparison import ComparisonParameters, textured_strip
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame, Side
from spinewatch.markers import FLAT_10_14_18
from spinewatch.parallel import both
from spinewatch.parameters import Parameters
from spinewatch.pipeline import StageMeasurer
from spinewatch.progress import Progress, part
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.rig_plausibility import check_measurable_rig
from spinewatch.stage import StageRequest
from spinewatch.tracking.synchronization import SynchronizationParameters, delay_flags, parallax_gain
from store import measurements, relabelling, spine_jobs, stage_work
from store.leases import Lease
from store.measurements import MeasuredStage
from store.packed_stage import PackedStage
from store.stage_work import PairWork, StageWork
from store.tables.jobs import STAGE_JOB
from workers.attempt import LeaseLostError
from workers.pair_results import pair_results
from workers.record_checks import burst_repetition_flags, repetition_flags, require_files, time_flags
from workers.registry import FilesWantedError, Handler, NotReadyError
from workers.stage_burst import burst_result, view_delay_s
from workers.stage_centres import EditedTake
from workers.stage_decisions import decide, decided
from workers.stage_edits import edited
from workers.stage_labels import label_pairs
from workers.stage_revision import (
    changed_parameters,
    changes_text,
    chosen_templates,
    parameters_of,
    revised_parameters,
    with_changes,
)
from workers.strips import packed

_Changed = Mapping[str, tuple[Any, Any]]
"""Values of parameters and the usual ones, by name."""
_VERSION = version("spinewatch")
_DAY = timedelta(days=1)
_MAX_RIGS = 8
"""Measurers that a worker keeps prepared, one per rig."""
_COMPARED_STAGES = 4
"""Number of the latest earlier stages whose gray levels a stage is compared with."""


class StageHandler(Handler[StageWork, MeasuredStage]):
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
        self._parameters = own = parameters or Parameters()
        self._max_age_days = max_calibration_age / _DAY
        self._clock_tolerance = clock_tolerance
        self._comparison = ComparisonParameters()
        self._synchronization = SynchronizationParameters()
        self._pool = pool = ThreadPoolExecutor(max_workers=1)

        @lru_cache(maxsize=_MAX_RIGS)
        def measurer(rig_json: str, changes_json: str = "{}", version: str | None = None) -> StageMeasurer:
            changes = json.loads(changes_json)
            used = revised_parameters(own, changes) if changes else own
            rig = parse_rig(rig_json)
            if used.search.matching.epipolar.range_mm is None:
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

    def add_files(self, session: Session, work: StageWork, wanted: frozenset[str]) -> StageWork:
        """Return the input with images of earlier stages.

        Parameters
        ----------
        session
            Session that reads.
        work
            The input.
        wanted
            SHA-256 of each image, hexadecimal.

        Returns
        -------
        StageWork
            The input with those that are not damaged.
        """
        return stage_work.with_files(session, work, wanted)

    def run(self, work: StageWork, progress: Progress) -> MeasuredStage:
        """Return what is measured in the stereo pair, or in the pairs of a burst; or the edited result of a revision.

        Parameters
        ----------
        work
            The images, rig and labels.
        progress
            Called at the start of each step.

        Returns
        -------
        MeasuredStage
            The result, with flags of the calibration's age, of implausible times, of repeated images and of views that
            were not exposed together.

        Raises
        ------
        SpinewatchError
            The images cannot be measured.
        NotReadyError
            Labels depend on an earlier stage whose job has not ended.
        FilesWantedError
            Images of earlier stages are to be compared whose strips do not tell them from those of the stage.
        """
        revision = work.revision
        if revision is None or isinstance(revision.changes, Remeasurement):
            return self._measured(work, progress, None)
        edits = revision.changes if isinstance(revision.changes, TriadEdits) else None
        if edits is not None and not edits.centres:
            return edited(revision.revised, edits, work.vertebrae, work.reference_vertebra)
        take = EditedTake(revision.revised, edits)
        return decided(
            self._measured(work, progress, take), take.decisions, take.removed, relabelled=edits is None
        )

    def _measured(self, work: StageWork, progress: Progress, take: EditedTake | None) -> MeasuredStage:
        """Return what is measured in the images; an unexpected error under changed parameters is theirs."""
        changed = self._changed(work)
        try:
            return self._measured_with(work, progress, take, changed)
        except (SpinewatchError, NotReadyError, FilesWantedError, LeaseLostError, MemoryError):
            raise
        except Exception as error:
            if not changed:
                raise
            raise ParameterError(
                f"the images cannot be measured with {changes_text(changed)}: {type(error).__name__}; give values"
                " nearer the usual ones"
            ) from error

    def _measured_with(
        self, work: StageWork, progress: Progress, take: EditedTake | None, changed: _Changed
    ) -> MeasuredStage:
        """Return what is measured in the images; from the features of a take with a person's edits, if there is one."""
        axis = cast(Literal["x", "y", "auto"], work.spine_axis)
        models = work.measuring.models or (FLAT_10_14_18,)
        request = StageRequest(
            labels=work.vertebrae, spine_axis=axis, models=models, extra_levels=work.extra_levels
        )
        measurer = self._measurer_for(work)
        pairs, measured = work.pairs, []
        progress("decode", 0.0)
        first = self._frames(pairs[0])
        pixels = {frame.side: frame.pixels for frame in first}
        digests = []
        require_files(work, pixels, self._comparison)
        repetitions = list(repetition_flags(work, pixels, self._comparison))
        for index, pair in enumerate(pairs):
            frames = first if index == 0 else self._frames(pair)
            step = _of_pair(progress, index, len(pairs))
            if len(pairs) > 1:
                digests.append(_digests(frames))
            measured.append(
                measurer.measure(*frames, request, step, explained=True)
                if take is None
                else take.measure(measurer, index + 1, frames, request, step)
            )
        labelled = label_pairs(measured, request, work)
        if take is not None:
            labelled = [
                replace(one, measurement=decide(one.measurement, take.decisions, work.vertebrae))
                for one in labelled
            ]
        made = _VERSION, {**self._settings(), "markers": [model.name for model in models]}
        if len(pairs) > 1:
            result = burst_result(pairs, labelled, request.labels, work.reference_vertebra, made)
        else:
            result = StageResult.of(labelled[0].measurement, *made).model_copy(
                update={"view_delay_s": view_delay_s(pairs[0]), "labelled_by": labelled[0].labelled_by}
            )
        record = [
            *time_flags(work, self._clock_tolerance),
            *repetitions,
            *burst_repetition_flags(digests),
            *self._delay_flags(work, measurer.rig),
            *_change_flags(changed),
        ]
        flags = [*result.flags, *self._age_flags(work.calibration_age / _DAY), *Flag.of(record)]
        result = result.model_copy(update={"flags": flags})
        strips = {} if work.revision is not None else self._strips(pixels)
        return MeasuredStage(result, pair_results([one.measurement for one in labelled], result), strips)

    def pack(self, result: MeasuredStage) -> PackedStage:
        """Return the rows of a measured stage.

        Parameters
        ----------
        result
            What was measured.

        Returns
        -------
        PackedStage
            The rows.
        """
        return result.packed()

    def store(
        self, session: Session, lease: Lease, result: PackedStage, now: datetime, actor: Actor
    ) -> tuple[str, ...]:
        """Add the measurement of the stage.

        Parameters
        ----------
        session
            Session that writes.
        lease
            The lease on the stage.
        result
            The rows of what was measured.
        now
            Time of the result.
        actor
            The worker.

        Returns
        -------
        tuple of str
            Jobs that find the labels of later stages again, and the one that computes the spines of the surgery, if it
            has a setup.
        """
        measurements.add(session, lease.subject_id, result, now, actor)
        if lease.surgery_id is None:
            return ()
        relabelled = relabelling.submit(session, lease.surgery_id, now, actor)
        job_id = spine_jobs.submit(session, lease.surgery_id, now)
        return relabelled if job_id is None else (*relabelled, job_id)

    def _measurer_for(self, work: StageWork) -> StageMeasurer:
        rig_json, sent = json.dumps(work.rig), work.measuring
        templates = sent.templates
        if work.revision is not None:
            changes = work.revision.changes
            if isinstance(changes, Remeasurement):
                templates = changes.templates or sent.templates
            else:
                templates = work.revision.revised.result.templates
        return self._measurer(rig_json, json.dumps(_wanted(work), sort_keys=True), templates)

    def _changed(self, work: StageWork) -> _Changed:
        """Return the parameters of a revision that are neither the worker's own nor sent with the images."""
        if work.revision is None:
            return {}
        used, usual = (
            to_jsonable_python(revised_parameters(self._parameters, changes))
            for changes in (_wanted(work), work.measuring.parameters)
        )
        return changed_parameters(used, usual)

    def _frames(self, pair: PairWork) -> tuple[Frame, Frame]:
        """Return both images of a pair."""
        left, right = both(decode_image, pair.left, pair.right, self._pool)
        return Frame(left, "left"), Frame(right, "right")

    def _strips(self, pixels: Mapping[Side, Pixels]) -> dict[str, bytes]:
        """Return the strips of images as they are stored, by side; without those of images that have none."""
        strips = ((side, textured_strip(image, self._comparison)) for side, image in pixels.items())
        return {side: packed(strip) for side, strip in strips if strip is not None}

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


def _wanted(work: StageWork) -> Mapping[str, Any]:
    """Return the parameters that differ from the worker's own."""
    sent = work.measuring.parameters
    if work.revision is None:
        return sent
    if isinstance(work.revision.changes, Remeasurement):
        return with_changes(sent, work.revision.changes.parameters)
    return parameters_of(work.revision.revised.result)


def _change_flags(changed: _Changed) -> list[spinewatch.flags.Flag]:
    if not changed:
        return []
    detail = (
        f"measured with other parameters than usual: {changes_text(changed)}; look at the take before too"
    )
    return [spinewatch.flags.Flag("parameters-changed", detail)]


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
