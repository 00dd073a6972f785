"""Plans: what a rig and a marker will achieve, computed at each request; nothing is stored."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Response

from contract.plan import AccuracyPlan, DisparityPlan
from service.dependencies import AdmissionDep, DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.plan_query import DepthQuery, MarkerQuery, RigQuery, TriadsQuery, rig_of
from service.problems import InvalidInputError
from service.turns import TurnsDep, in_turn
from spinewatch.errors import ParameterError
from spinewatch.planning.accuracy import straight_chain
from spinewatch.planning.disparity import disparity_grid
from spinewatch.planning.marker_design import MarkerDesignParameters, design_marker
from spinewatch.planning.plan import make_plan
from spinewatch.simulation.rigs import convergence_point
from store.database import Database

router = APIRouter(prefix="/v1/plans", tags=["plans"])


@router.get("/accuracy", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=AccuracyPlan)
async def get_accuracy_plan(
    rig_query: Annotated[RigQuery, Depends()],
    marker: Annotated[MarkerQuery, Depends()],
    triads: Annotated[TriadsQuery, Depends()],
    depth: Annotated[DepthQuery, Depends()],
    database: DatabaseDep,
    turns: TurnsDep,
    admission: AdmissionDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the accuracy that a rig and a marker will give, from the normal equations.

    The rig is that of a calibration, or two equal cameras without distortion, side by side along X at the same height,
    whose axes meet at the origin.
    """
    text = await in_turn(
        turns.planning, admission.key_prefix, _accuracy_plan, rig_query, marker, triads, depth, database
    )
    return document_response(text, if_none_match)


@router.get("/disparity", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=DisparityPlan)
async def get_disparity_plan(
    rig_query: Annotated[RigQuery, Depends()],
    depth: Annotated[DepthQuery, Depends()],
    database: DatabaseDep,
    turns: TurnsDep,
    admission: AdmissionDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the disparities of a rig over its field of view and a range of depth."""
    key = admission.key_prefix
    text = await in_turn(turns.planning, key, _disparity_plan, rig_query, depth, database)
    return document_response(text, if_none_match)


def _accuracy_plan(
    rig_query: RigQuery, marker: MarkerQuery, triads: TriadsQuery, depth: DepthQuery, database: Database
) -> str:
    rig = rig_of(rig_query, database)
    parameters = triads.parameters(depth.heights_mm())
    model = marker.legs()
    if marker.disc_radius_mm is not None:
        chain = straight_chain(
            parameters.vertebrae, convergence_point(rig), parameters.spacing_mm, parameters.spine_axis
        )
        constraints = MarkerDesignParameters(ball_diameter_mm=marker.ball_diameter_mm)
        try:
            model = design_marker(rig, chain, parameters.sigma_px, marker.disc_radius_mm, constraints)
        except ParameterError as error:
            raise InvalidInputError("disc_radius_mm", error, part="query") from error
    frame = (
        f"object space of calibration {rig.name}"
        if rig_query.calibration_id is not None
        else "origin where the optical axes meet, X along the baseline, Z up to the cameras"
    )
    return AccuracyPlan.of(make_plan(rig, model, parameters), rig, frame).model_dump_json(by_alias=True)


def _disparity_plan(rig_query: RigQuery, depth: DepthQuery, database: Database) -> str:
    rig = rig_of(rig_query, database)
    heights, middle = depth.heights_mm(), float(convergence_point(rig)[2])
    grid = disparity_grid(rig, (heights[0] + middle, heights[-1] + middle), len(heights))
    return DisparityPlan.of(grid, rig.name, middle).model_dump_json(by_alias=True)
