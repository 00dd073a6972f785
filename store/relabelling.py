"""Later stages whose labels an earlier take decided on: they are found again when another take counts."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session, joinedload

from contract.burst import LabelSource
from contract.event import Actor
from contract.job import FINAL_STATES
from contract.revision import Relabelling
from store import stage_submission, stage_work, stages
from store.tables.measurements import Measurement
from store.tables.stages import Stage

_labelled_by = Measurement.result["labelled_by"]
_LABELLED = (
    select(Stage.id)
    .join(Measurement, Measurement.stage_id == Stage.id)
    .where(Stage.surgery_id == bindparam("surgery_id"), _labelled_by.as_string().is_not(None))
    .limit(1)
)


def submit(session: Session, surgery_id: str, now: datetime, actor: Actor) -> tuple[str, ...]:
    """Add a revision of each stage whose labels were decided by a take that would not decide on them now.

    Parameters
    ----------
    session
        Session that writes, in the transaction that stores a result of the surgery.
    surgery_id
        Identifier of the surgery.
    now
        Time of the result.
    actor
        The worker.

    Returns
    -------
    tuple of str
        Identifiers of the jobs, which the caller enqueues after the commit.
    """
    if session.execute(_LABELLED, {"surgery_id": surgery_id}).first() is None:
        return ()
    query = select(Stage, _labelled_by).join(Measurement, Measurement.stage_id == Stage.id)
    query = query.where(Stage.id.in_(stages.counting(surgery_id)))
    jobs = []
    for stage, found in session.execute(query.options(joinedload(Stage.surgery))).all():
        if found is None or not _is_outdated(session, stage, LabelSource.model_validate(found)):
            continue
        changes = Relabelling(kind="relabel", take=stage.take)
        revision = stage_submission.revise(session, surgery_id, stage.name, changes, now, actor)
        jobs.append(revision.job.id)
    return tuple(jobs)


def _is_outdated(session: Session, stage: Stage, source: LabelSource) -> bool:
    """Return whether another take would decide on the labels of a stage now, and nothing was asked for meanwhile."""
    latest = stages.get(session, stage.surgery_id, stage.name)
    if latest.id != stage.id or latest.job.state not in FINAL_STATES:
        return False
    decides, unended = stage_work.labelled_before(session, stage)
    if unended is not None:
        return False
    now = None if decides is None else (decides.name, decides.take)
    return now != (source.stage, source.take)
