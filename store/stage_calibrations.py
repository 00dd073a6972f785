"""Calibrations of the earlier stages of a surgery, and how the balls of each stage fit them."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from contract.job import JobState
from store.tables.base import Document
from store.tables.calibrations import Calibration
from store.tables.jobs import Job
from store.tables.measurements import Measurement
from store.tables.stages import Stage


@dataclass(frozen=True)
class EarlierCalibration:
    """The calibration of a stage that was submitted before the one in work.

    Attributes
    ----------
    name
        Name of the stage.
    other_rig
        Rig JSON of its calibration; None if that is the calibration of the stage in work.
    rig_check
        Check of the rig by its balls, if it was measured with that same calibration.
    """

    name: str
    other_rig: Document | None = None
    rig_check: Document | None = None


def earlier_calibrations(session: Session, stage: Stage) -> tuple[EarlierCalibration, ...]:
    """Return the calibrations of the stages of other names that were submitted before a stage.

    Of each name the latest take of these counts whose job has not failed and was not cancelled: what it replaced was
    taken with another calibration or measured with another marker because that was wrong.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The stage.

    Returns
    -------
    tuple of EarlierCalibration
        In the order in which the names were first submitted.
    """
    wanted = {"surgery_id": stage.surgery_id, "name": stage.name, "number": stage.number}
    latest = {row.name: row for row in session.execute(_SENT_BEFORE, wanted)}
    return tuple(
        EarlierCalibration(name, rig_check=check)
        if calibration_id == stage.calibration_id
        else EarlierCalibration(name, other_rig=rig)
        for name, calibration_id, rig, check in latest.values()
    )


_SENT_BEFORE = (
    select(Stage.name, Stage.calibration_id, Calibration.rig, Measurement.result["rig_check"])
    .join(Stage.calibration)
    .join(Stage.job)
    .outerjoin(Stage.measurement)
    .where(
        Stage.surgery_id == bindparam("surgery_id"),
        Stage.name != bindparam("name"),
        Stage.number < bindparam("number"),
        Job.state.not_in((JobState.FAILED, JobState.CANCELLED)),
    )
    .order_by(Stage.number, Stage.take)
)
