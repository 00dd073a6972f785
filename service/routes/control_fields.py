"""Control fields that are to be built, computed at each request; nothing is stored."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Depends, Query, Response

from contract.control_field import ControlFieldPlan
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.plan_query import RigQuery, rig_of
from spinewatch.calibration.control_field import low_high_field
from spinewatch.calibration.point_tables import control_field_csv
from spinewatch.planning.field_view import visible_in_both
from spinewatch.simulation.rigs import convergence_point

router = APIRouter(prefix="/v1/plans/control-field", tags=["plans"])


@router.get("", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=ControlFieldPlan)
def get_control_field_plan(
    rig_query: Annotated[RigQuery, Depends()],
    database: DatabaseDep,
    rows: Annotated[int, Query(ge=3, le=30, description="Rows of pegs.")] = 5,
    columns: Annotated[int, Query(ge=3, le=30, description="Columns of pegs.")] = 6,
    spacing_mm: Annotated[
        float, Query(ge=5, le=1000, allow_inf_nan=False, description="Distance between neighbours, mm.")
    ] = 127.0,
    seed: Annotated[int, Query(ge=0, le=2**31 - 1, description="Seed of the random heights.")] = 0,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get a board on which low and high pegs alternate (thesis section 3.3), and the points that a rig shows of it."""
    rig = rig_of(rig_query, database)
    field = low_high_field(rows, columns, spacing_mm, np.random.default_rng(seed))
    shift_mm = convergence_point(rig) - field.points_mm.mean(axis=0)
    visible = visible_in_both(rig, replace(field, points_mm=field.points_mm + shift_mm))
    return document_response(ControlFieldPlan.of(field, control_field_csv(field), visible), if_none_match)
