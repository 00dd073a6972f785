"""What the stages measured with a calibration say about it."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session, contains_eager

from store.page import Page, page_of
from store.tables import Measurement, Stage

OLD, DRIFTED, REFINED = "calibration-old", "calibration-drift", "rig-refined"
DOUBTS = frozenset({OLD, DRIFTED, REFINED})
"""The flags of a stage that are about its calibration."""


@dataclass(frozen=True)
class Summary:
    """How many stages were measured with a calibration, and how many doubt it for which reason."""

    stages: int
    drifted: int
    old: int


def listed(session: Session, calibration_id: str, limit: int, offset: int) -> Page[Stage]:
    """Return a page of the stages measured with a calibration, oldest first, with their measurements."""
    query = select(Stage).join(Stage.measurement).where(Stage.calibration_id == calibration_id)
    query = query.options(contains_eager(Stage.measurement)).order_by(Stage.created_at, Stage.id)
    return page_of(session, query, limit, offset)


def summary(session: Session, calibration_id: str) -> Summary:
    """Return what all stages measured with a calibration say together."""
    query = select(Measurement.flags).join(Stage).where(Stage.calibration_id == calibration_id)
    found = [{flag["code"] for flag in flags} for flags in session.scalars(query)]
    return Summary(
        stages=len(found),
        drifted=sum(DRIFTED in codes for codes in found),
        old=sum(OLD in codes for codes in found),
    )
