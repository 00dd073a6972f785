"""What the spine of each measured stage is computed from.

The spine of a stage depends on the setup, on the re-clamped markers, and on the measurements of the stage, of the
baseline and of the stage before; the fingerprint names them all.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from sqlalchemy import BindParameter, ColumnElement, and_, select
from sqlalchemy.orm import Session

from contract.spine_setup import StoredSpineSetup
from contract.stage_reference import StageReference
from spinewatch.spine.stage_order import comparisons
from store import stages
from store.tables.measurements import Triad
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


class Take(Protocol):
    """What of a take the spine of its stage depends on."""

    @property
    def id(self) -> str:
        """Identifier of the take."""

    @property
    def name(self) -> str:
        """Name of the stage."""

    @property
    def take(self) -> int:
        """Number of the take."""

    @property
    def calibration_id(self) -> str:
        """Identifier of the calibration."""


@dataclass(frozen=True)
class StagePlan:
    """What the spine of a measured stage is computed from.

    Attributes
    ----------
    stage_id
        Identifier of the stage.
    reference
        Name, take and calibration of the stage.
    baseline
        Name of the baseline stage, which may have no result yet.
    previous
        Name of the stage before, of those that have a pose of the reference triad; None for the first one.
    fingerprint
        SHA-256 of the inputs, hexadecimal.
    """

    stage_id: str
    reference: StageReference
    baseline: str
    previous: str | None
    fingerprint: str


def plans(session: Session, surgery: Surgery, setup: StoredSpineSetup) -> tuple[StagePlan, ...]:
    """Return what the spine of each measured stage is computed from.

    Parameters
    ----------
    session
        Session that reads.
    surgery
        The surgery.
    setup
        Its setup.

    Returns
    -------
    tuple of StagePlan
        Measured stages in the order of `stages.IN_ORDER`. Without a named baseline it is the first stage of the
        surgery, whatever became of it.
    """
    reference = setup.setup.reference_vertebra or surgery.reference_vertebra
    posed = select(Triad.stage_id).where(Triad.stage_id == Stage.id, is_posed(reference)).exists()
    query = select(Stage, posed).where(Stage.id.in_(stages.counting(surgery.id)))
    rows = session.execute(query.order_by(*stages.IN_ORDER))
    first = select(Stage.name).where(Stage.surgery_id == surgery.id).order_by(*stages.IN_ORDER).limit(1)
    return plans_of(setup, session.scalars(first).first(), [(stage, has) for stage, has in rows])


def is_posed(vertebra: str | BindParameter[str]) -> ColumnElement[bool]:
    """Return the condition for the triad of a vertebra that has a pose.

    Parameters
    ----------
    vertebra
        Label of the triad, or the parameter for it.

    Returns
    -------
    ColumnElement
        The condition on a row of triads.
    """
    return and_(Triad.label == vertebra, Triad.triad["position_mm"].as_string().is_not(None))


def plans_of(
    setup: StoredSpineSetup, first: str | None, rows: Sequence[tuple[Take, bool]]
) -> tuple[StagePlan, ...]:
    """Return what the spine of each measured stage is computed from, as `plans`.

    Parameters
    ----------
    setup
        The setup of the surgery.
    first
        Name of the first stage of the surgery, measured or not; None while there is none.
    rows
        The take of each measured stage whose results count, in the order of `stages.IN_ORDER`, and whether it has a
        pose of the reference triad.

    Returns
    -------
    tuple of StagePlan
        In the same order.
    """
    if first is None:
        return ()
    ids = {stage.name: stage.id for stage, _ in rows}
    clamped = [[ids.get(item.before), ids.get(item.after)] for item in setup.rebaselines]
    compared = comparisons(first, [(stage.name, has) for stage, has in rows], setup.setup.baseline)
    planned = []
    for (stage, _), others in zip(rows, compared, strict=True):
        inputs = [
            setup.revision,
            clamped,
            stage.id,
            ids.get(others.baseline),
            others.previous and ids[others.previous],
        ]
        planned.append(
            StagePlan(
                stage_id=stage.id,
                reference=StageReference(
                    name=stage.name, take=stage.take, calibration_id=stage.calibration_id
                ),
                baseline=others.baseline,
                previous=others.previous,
                fingerprint=hashlib.sha256(json.dumps(inputs).encode()).hexdigest(),
            )
        )
    return tuple(planned)
