"""Lists of jobs."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from contract.job import JobState
from store.page import Page, PageRequest, created_within, page_of
from store.tables.jobs import Job
from store.tables.surgeries import Tombstone


def listed(
    session: Session,
    wanted: PageRequest,
    *,
    state: JobState | None = None,
    kind: str | None = None,
    surgery_id: str | None = None,
    created_after: datetime | None = None,
    created_before: datetime | None = None,
) -> Page[Job]:
    """Return a page of jobs with the stages that they measure.

    Parameters
    ----------
    session
        Session that reads.
    wanted
        Which part of the list.
    state
        Only those in this state.
    kind
        Only those of this kind.
    surgery_id
        Only those of a surgery.
    created_after, created_before
        Only those created at the first time or later, and before the second one.

    Returns
    -------
    Page of Job
        The rows, without those of surgeries that were deleted.
    """
    query = created_within(select(Job), Job, created_after, created_before)
    of_surgery = Job.payload["surgery_id"].as_string()
    query = query.where(or_(of_surgery.is_(None), of_surgery.not_in(select(Tombstone.surgery_id))))
    if state is not None:
        query = query.where(Job.state == state)
    if kind is not None:
        query = query.where(Job.kind == kind)
    if surgery_id is not None:
        query = query.where(of_surgery == surgery_id)
    return page_of(session, query.options(joinedload(Job.stage)), Job, wanted)
