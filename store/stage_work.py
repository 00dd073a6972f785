"""What a worker needs to measure a stage: images, rig, labels and earlier stages."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta

from pydantic import TypeAdapter
from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session, joinedload, selectinload

import contract.measuring
import contract.revision
import contract.triad
from contract.job import FINAL_STATES, JobState
from spinewatch.triads.pose import Pose
from store import calibrations, images, pair_results, results
from store.errors import ImageDamagedError
from store.measurements import MeasuredStage
from store.stage_calibrations import EarlierCalibration, earlier_calibrations
from store.stages import IN_ORDER, measuring_of, sha256_by_side
from store.tables.base import Document
from store.tables.jobs import Job
from store.tables.measurements import FeatureList, Triad
from store.tables.stages import Stage


@dataclass(frozen=True)
class EarlierStage:
    """A stage of the surgery that was submitted before the one in work.

    Attributes
    ----------
    name
        Name of the stage.
    captured_at
        When it was taken, None when unknown.
    sha256
        SHA-256 of its image files, hexadecimal, by side.
    follows
        Whether it comes after the one in work in the order of the stages: a later take keeps the place of its name.
    is_compared
        Whether its gray levels are compared with those of the stage in work.
    strips
        Strips of its images by side, as they are stored, if it is compared; without those that are not stored.
    """

    name: str
    captured_at: datetime | None
    sha256: Mapping[str, str]
    follows: bool = False
    is_compared: bool = False
    strips: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class PairWork:
    """A stereo pair of a burst in work.

    Attributes
    ----------
    left, right
        The image files.
    left_exposed_at, right_exposed_at
        When each was exposed, None when unknown.
    """

    left: bytes
    right: bytes
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None


@dataclass(frozen=True)
class LabelledStage:
    """A stage before the one in work, whose result has the poses of all labels.

    Attributes
    ----------
    name, take
        Name and take of the stage.
    poses
        Poses by label.
    """

    name: str
    take: int
    poses: Mapping[str, Pose]


@dataclass(frozen=True)
class RevisionWork:
    """What is changed of an earlier take of a stage.

    Attributes
    ----------
    changes
        What was asked for.
    revised
        The result of the take, and what its pairs were measured from.
    """

    changes: contract.revision.NewRevision
    revised: MeasuredStage


@dataclass(frozen=True)
class StageWork:
    """What a worker needs to measure a stage.

    Attributes
    ----------
    left, right
        The image files of the pair, or of the first pair of a burst.
    sha256
        Their SHA-256, hexadecimal, by side.
    rig
        The rig JSON.
    captured_at
        When the stage was taken, or its left image exposed, None when unknown.
    calibrated_at, calibration_created_at
        When the rig was calibrated, None when unknown, and when the calibration was stored.
    calibration_age
        Age of the calibration when the stage was taken.
    earlier
        Stages of other names that were submitted before, in that order, whatever has become of their jobs.
    vertebrae
        Labels in order of increasing coordinate along the spine axis.
    spine_axis
        x, y or auto.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    name, take
        Name and take of the stage.
    reference_vertebra
        The vertebra in whose frame motion is given.
    left_exposed_at, right_exposed_at
        When each image was exposed, None when unknown.
    further
        The other pairs of a burst.
    labelled
        The last of the stages before it whose result has the poses of all labels; None if there is none, or if
        ``unended_job`` has to end first.
    unended_job
        Job of the last of the stages before it that may yet be ``labelled``; None if that is decided.
    revision
        What is changed of an earlier take of the stage; None for a take with images of its own.
    measuring
        What is known of the pairs, and how they are measured, as it was sent with the images.
    files
        Images of earlier stages, by their SHA-256; None until the work has asked for some. A damaged one is missing.
    earlier_calibrations
        Calibrations of stages of other names that were submitted before.
    """

    left: bytes
    right: bytes
    sha256: Mapping[str, str]
    rig: Document
    captured_at: datetime | None
    calibrated_at: datetime | None
    calibration_created_at: datetime
    calibration_age: timedelta
    earlier: tuple[EarlierStage, ...]
    vertebrae: tuple[str, ...]
    spine_axis: str
    extra_levels: tuple[str, ...]
    name: str = ""
    take: int = 1
    reference_vertebra: str = ""
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None
    further: tuple[PairWork, ...] = ()
    labelled: LabelledStage | None = None
    unended_job: str | None = None
    revision: RevisionWork | None = None
    measuring: contract.measuring.Measuring = field(default_factory=contract.measuring.Measuring)
    files: Mapping[str, bytes] | None = None
    earlier_calibrations: tuple[EarlierCalibration, ...] = ()

    @property
    def pairs(self) -> tuple[PairWork, ...]:
        """All pairs, in the order in which they were taken."""
        first = PairWork(self.left, self.right, self.left_exposed_at, self.right_exposed_at)
        return (first, *self.further)


def work(session: Session, stage_id: str, max_compared: int = 0) -> StageWork:
    """Return what a worker needs to measure a stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.
    max_compared
        Number of the latest earlier stages whose gray levels are compared.

    Returns
    -------
    StageWork
        Images, rig, labels and earlier stages.
    """
    stage = session.scalars(_WHOLE, {"stage_id": stage_id}).one()
    labelled, unended_job = labelled_before(session, stage)
    return StageWork(
        left=images.content(session, stage.left_sha256),
        right=images.content(session, stage.right_sha256),
        sha256=sha256_by_side(stage),
        rig=stage.calibration.rig,
        captured_at=stage.captured_at or stage.left_exposed_at,
        calibrated_at=stage.calibration.calibrated_at,
        calibration_created_at=stage.calibration.created_at,
        calibration_age=calibrations.age(stage.calibration, stage),
        earlier=_earlier(session, stage, max_compared),
        vertebrae=tuple(stage.surgery.vertebrae),
        spine_axis=stage.surgery.spine_axis,
        extra_levels=tuple(stage.surgery.extra_levels),
        name=stage.name,
        take=stage.take,
        reference_vertebra=stage.surgery.reference_vertebra,
        left_exposed_at=stage.left_exposed_at,
        right_exposed_at=stage.right_exposed_at,
        further=tuple(
            PairWork(
                images.content(session, pair.left_sha256),
                images.content(session, pair.right_sha256),
                pair.left_exposed_at,
                pair.right_exposed_at,
            )
            for pair in stage.further_pairs
        ),
        labelled=labelled,
        unended_job=unended_job,
        revision=_revision(session, stage),
        measuring=measuring_of(session, stage),
        earlier_calibrations=earlier_calibrations(session, stage),
    )


def _revision(session: Session, stage: Stage) -> RevisionWork | None:
    if stage.revised_take is None:
        return None
    query = select(Stage.id).where(
        Stage.surgery_id == stage.surgery_id, Stage.name == stage.name, Stage.take == stage.revised_take
    )
    changes = TypeAdapter[contract.revision.NewRevision](contract.revision.NewRevision).validate_python(
        stage.changes
    )
    stage_id = session.scalars(query).one()
    revised = MeasuredStage(results.whole(session, stage_id), pair_results.all_of(session, stage_id))
    return RevisionWork(changes, revised)


def with_files(session: Session, work: StageWork, wanted: Collection[str]) -> StageWork:
    """Return the work with images of earlier stages; serving a damaged one names the damage.

    Parameters
    ----------
    session
        Session that reads.
    work
        The work.
    wanted
        SHA-256 of each image, hexadecimal.

    Returns
    -------
    StageWork
        The work with those that are not damaged.
    """
    files = {}
    for sha256 in wanted:
        with suppress(ImageDamagedError):
            files[sha256] = images.content(session, sha256)
    return replace(work, files=files)


def _earlier(session: Session, stage: Stage, max_compared: int) -> tuple[EarlierStage, ...]:
    """Return the stages submitted before a stage; takes of its own name show the same moment."""
    rows = session.execute(
        _SENT_BEFORE, {"surgery_id": stage.surgery_id, "name": stage.name, "number": stage.number}
    ).all()
    first = max(len(rows) - max_compared, 0)
    strips: dict[str, dict[str, bytes]] = {row.id: {} for row in rows[first:]}
    for stage_id, side, strip in session.execute(_STRIPS, {"stage_ids": list(strips)}):
        if strip is not None:
            strips[stage_id][side] = strip
    return tuple(
        EarlierStage(
            name,
            captured or exposed,
            {"left": left, "right": right},
            place > stage.place,
            stage_id in strips,
            strips.get(stage_id, {}),
        )
        for stage_id, name, captured, exposed, left, right, place in rows
    )


def labelled_before(session: Session, stage: Stage) -> tuple[LabelledStage | None, str | None]:
    """Return the last stage before a stage whose result has the poses of all labels, or the job to wait for.

    A stage keeps the place of its first take, so that none is labelled by one that it has labelled. A stage whose job
    failed or was cancelled is passed over. One whose job has not ended may have all poses, so that a stage before it
    must not be taken: the answer would depend on which job ends first.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The stage, with its surgery.

    Returns
    -------
    labelled : LabelledStage or None
        The stage that decides on labels; None if there is none, or if a job has to end first.
    unended_job : str or None
        That job.
    """
    labels = set(stage.surgery.vertebrae)
    for stage_id, name, take, job_id, state in session.execute(
        _LATEST_BEFORE, {"surgery_id": stage.surgery_id, "place": stage.place}
    ):
        if state not in FINAL_STATES:
            return None, job_id
        if state is JobState.SUCCEEDED:
            rows = session.scalars(_TRIADS, {"stage_id": stage_id})
            triads = [contract.triad.Triad.model_validate(triad) for triad in rows]
            poses = {triad.label: triad.pose() for triad in triads if triad.label in labels}
            found = {label: pose for label, pose in poses.items() if label is not None and pose is not None}
            if labels == set(found):
                return LabelledStage(name, take, found), None
    return None, None


_WHOLE = (
    select(Stage)
    .where(Stage.id == bindparam("stage_id"))
    .options(joinedload(Stage.surgery), joinedload(Stage.calibration), selectinload(Stage.further_pairs))
)
_TRIADS = select(Triad.triad).where(Triad.stage_id == bindparam("stage_id")).order_by(Triad.position)
_LATEST_BEFORE = (
    select(Stage.id, Stage.name, Stage.take, Job.id, Job.state)
    .join(Stage.job)
    .where(Stage.surgery_id == bindparam("surgery_id"), Stage.place < bindparam("place"))
    .order_by(*(column.desc() for column in IN_ORDER))
)
_SENT_BEFORE = (
    select(
        Stage.id,
        Stage.name,
        Stage.captured_at,
        Stage.left_exposed_at,
        Stage.left_sha256,
        Stage.right_sha256,
        Stage.place,
    )
    .where(
        Stage.surgery_id == bindparam("surgery_id"),
        Stage.name != bindparam("name"),
        Stage.number < bindparam("number"),
        Stage.revised_take.is_(None),  # a revision has the images of its take
    )
    .order_by(Stage.number)
)
_STRIPS = select(FeatureList.stage_id, FeatureList.side, FeatureList.strip).where(
    FeatureList.stage_id.in_(bindparam("stage_ids", expanding=True))
)
