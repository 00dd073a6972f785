"""Motion between two stages by the method of 1995, computed from the stored poses at each request."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from contract.base import StageName
from contract.flag import Flag
from contract.legacy_motion import LegacyComparison, LegacyMotion, LegacyTable, TriadRow
from service.dependencies import DatabaseDep, problems
from service.parameters import SurgeryId
from spinewatch.spine import legacy_1995
from store import measurements, surgeries

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/motion/legacy-1995", tags=["motion"])


@router.get("", responses=problems(404, 409, 422))
def get_legacy_motion(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    start: Annotated[StageName, Query(alias="from", description="The earlier stage.")],
    end: Annotated[StageName, Query(alias="to", description="The later stage.")],
) -> LegacyComparison:
    """Get the triads of two stages as in Table 6.1 of the thesis, and their motion by its eq. 6.1.

    The rotation about the normal is lost, and a cart that turned between the stages shows as a motion: `/motion` has
    neither fault.
    """
    with database.read() as session:
        surgery = surgeries.get(session, surgery_id)
        found = [measurements.get(session, surgery_id, name)[0] for name in (start, end)]
        poses = [measurements.poses(session, stage.id) for stage in found]
    first, last = (legacy_1995.triad_table(each, surgery.reference_vertebra) for each in poses)
    before, after = (
        LegacyTable(
            stage=stage.name,
            take=stage.take,
            frame=f"object axes of calibration {stage.calibration.name}, from triad {surgery.reference_vertebra}",
            rows=[TriadRow.of(row) for row in table],
        )
        for stage, table in zip(found, (first, last), strict=True)
    )
    return LegacyComparison(
        surgery_id=surgery_id,
        method="legacy_1995",
        reference_vertebra=surgery.reference_vertebra,
        before=before,
        after=after,
        motion=[LegacyMotion.of(motion) for motion in legacy_1995.legacy_motion(first, last)],
        flags=Flag.of(legacy_1995.legacy_flags(first, last, tuple(surgery.extra_levels))),
    )
