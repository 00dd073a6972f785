"""Checks of a calibration by the stages that were measured with it."""

from __future__ import annotations

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session, contains_eager

from contract.calibration_check import ChecksSummary
from contract.stage import MarkerScale
from store.page import Page, PageRequest, page_of
from store.tables.measurements import Measurement
from store.tables.stages import Stage
from store.tables.surgeries import Tombstone

OLD, DRIFTED, REFINED = "calibration-old", "calibration-drift", "rig-refined"
CALIBRATION_FLAGS = frozenset({OLD, DRIFTED, REFINED})
"""The flags of a stage that are about its calibration."""


def listed(session: Session, calibration_id: str, wanted: PageRequest) -> Page[Stage]:
    """Return a page of the stages measured with a calibration; revisions, whose images are the same, are left out.

    Parameters
    ----------
    session
        Session that reads.
    calibration_id
        Identifier of the calibration.
    wanted
        Which part of the list.

    Returns
    -------
    Page of Stage
        The rows with their measurements, without those of surgeries that were deleted.
    """
    query = select(Stage).join(Stage.measurement).where(*_measured_with(calibration_id))
    query = query.where(Stage.surgery_id.not_in(select(Tombstone.surgery_id)))
    return page_of(session, query.options(contains_eager(Stage.measurement)), Stage, wanted)


def marker_scales(session: Session, calibration_id: str) -> list[MarkerScale]:
    """Return the scale of the markers in every stage measured with a calibration that has one.

    Parameters
    ----------
    session
        Session that reads.
    calibration_id
        Identifier of the calibration.

    Returns
    -------
    list of MarkerScale
        The scales, oldest stage first.
    """
    query = select(Measurement.result["rig_check"]).join(Stage).where(*_measured_with(calibration_id))
    checks = session.scalars(query.order_by(Stage.created_at, Stage.id))
    scales = [(check or {}).get("marker_scale") for check in checks]
    return [MarkerScale.model_validate(scale) for scale in scales if scale is not None]


def summary(session: Session, calibration_id: str) -> ChecksSummary:
    """Return the number of stages measured with a calibration, and of those that question it.

    Parameters
    ----------
    session
        Session that reads.
    calibration_id
        Identifier of the calibration.

    Returns
    -------
    ChecksSummary
        The numbers.
    """
    query = select(Measurement.result["flags"]).join(Stage).where(*_measured_with(calibration_id))
    found = [{flag["code"] for flag in flags} for flags in session.scalars(query)]
    return ChecksSummary(
        stages=len(found),
        drifted=sum(DRIFTED in codes for codes in found),
        old=sum(OLD in codes for codes in found),
    )


def _measured_with(calibration_id: str) -> tuple[ColumnElement[bool], ...]:
    return Stage.calibration_id == calibration_id, Stage.revised_take.is_(None)
