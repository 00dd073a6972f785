"""Jobs that measure a stage of a surgery."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from datetime import datetime, timedelta
from importlib.metadata import version
from typing import Any, Literal, cast

from sqlalchemy.orm import Session

from contract.event import Actor
from contract.flag import Flag
from contract.revision import Remeasurement, TriadEdits
from contract.stage import StageResult
from settings import Settings
from spinewatch.arrays import Pixels
from spinewatch.calibration.quality.lens_comparison import LensComparisonParameters
from spinewatch.detection.candidates.templates import TemplateSet
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.imaging.comparison import ComparisonParameters, textured_strip
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame, Side
from spinewatch.markers import FLAT_10_14_18
from spinewatch.parallel import both
from spinewatch.parameters import Parameters
from spinewatch.progress import Progress, part
from spinewatch.stage import StageRequest
from spinewatch.tracking.synchronization import SynchronizationParameters
from store import measurements, relabelling, spine_jobs, stage_work
from store.leases import Lease
from store.measurements import MeasuredStage
from store.packed_stage import PackedStage
from store.stage_work import PairWork, StageWork
from store.tables.jobs import STAGE_JOB
from workers.attempt import LeaseLostError
from workers.calibration_checks import calibration_flags
from workers.pair_results import pair_results
from workers.record_checks import (
    age_flags,
    burst_repetition_flags,
    change_flags,
    gray_level_digests,
    repetition_flags,
    require_files,
    time_flags,
    view_delay_flags,
)
from workers.registry import FilesWantedError, Handler, NotReadyError
from workers.stage_burst import burst_result, view_delay_s
from workers.stage_centres import EditedTake
from workers.stage_decisions import decide, decided
from workers.stage_edits import edited
from workers.stage_labels import label_pairs
from workers.stage_manual_labels import check_manual_labels
from workers.stage_measurers import StageMeasurers, template_set
from workers.stage_revision import Changed, changes_text
from workers.strips import packed

_VERSION = version("spinewatch")
_DAY = timedelta(days=1)
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
        self._max_age_days = max_calibration_age / _DAY
        self._clock_tolerance = clock_tolerance
        self._comparison = ComparisonParameters()
        self._synchronization = SynchronizationParameters()
        self._lenses = LensComparisonParameters()
        self._pool = ThreadPoolExecutor(max_workers=1)
        self._measurers = StageMeasurers(templates, parameters or Parameters(), self._pool)

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
            changed = edited(revision.revised, edits, work.vertebrae, work.reference_vertebra)
        else:
            take = EditedTake(revision.revised, edits)
            measured = self._measured(work, progress, take)
            changed = decided(measured, take.decisions, take.removed, relabelled=edits is None)
        return check_manual_labels(changed, _request(work), work.labelled)

    def _measured(self, work: StageWork, progress: Progress, take: EditedTake | None) -> MeasuredStage:
        """Return what is measured in the images; an unexpected error under changed parameters is theirs."""
        changed = self._measurers.changed(work)
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
        self, work: StageWork, progress: Progress, take: EditedTake | None, changed: Changed
    ) -> MeasuredStage:
        """Return what is measured in the images; from the features of a take with a person's edits, if there is one."""
        request = _request(work)
        measurer = self._measurers.of(work)
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
                digests.append(gray_level_digests(frames))
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
        made = _VERSION, {**self._settings(), "markers": [model.name for model in request.models]}
        if len(pairs) > 1:
            result = burst_result(pairs, labelled, request.labels, work.reference_vertebra, made)
        else:
            result = StageResult.of(labelled[0].measurement, *made).model_copy(
                update={"view_delay_s": view_delay_s(pairs[0]), "labelled_by": labelled[0].labelled_by}
            )
        record = [
            *age_flags(work.calibration_age, self._max_age_days),
            *time_flags(work, self._clock_tolerance),
            *repetitions,
            *burst_repetition_flags(digests),
            *view_delay_flags(work, measurer.rig, self._synchronization),
            *calibration_flags(work, measurer.rig, result.rig_check, self._lenses),
            *change_flags(changed),
        ]
        flags = [*result.flags, *Flag.of(record)]
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
            "lenses": asdict(self._lenses),
            "synchronization": asdict(self._synchronization),
        }


def _request(work: StageWork) -> StageRequest:
    """Return what is known of a stage before its images are measured."""
    return StageRequest(
        labels=work.vertebrae,
        spine_axis=cast(Literal["x", "y", "auto"], work.spine_axis),
        models=work.measuring.models or (FLAT_10_14_18,),
        extra_levels=work.extra_levels,
    )


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
    return StageHandler(template_set(settings.templates), settings.calibration_max_age_days * _DAY, tolerance)
