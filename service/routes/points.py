"""Points of a calibrated rig from given image points, computed at each request; nothing is stored."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Response

from contract.point import Points
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.parameters import CalibrationId
from service.problems import InvalidInputError
from spinewatch.camera import Camera, Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.rig_files.rig_json import rig_from_dict
from store import calibrations

router = APIRouter(prefix="/v1/calibrations/{calibration_id}/points", tags=["calibrations"])

MAX_POINTS = 24
_NUMBER = r"-?[0-9]{1,6}(\.[0-9]{1,9})?"
ImagePoint = Annotated[str, Query(pattern=f"^{_NUMBER},{_NUMBER}$", max_length=40)]


@router.get("", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=Points)
def get_points(
    calibration_id: CalibrationId,
    database: DatabaseDep,
    left: Annotated[
        list[ImagePoint],
        Query(min_length=1, max_length=MAX_POINTS, description="Left image u,v of each point, px; repeated."),
    ],
    right: Annotated[
        list[ImagePoint],
        Query(min_length=1, max_length=MAX_POINTS, description="Right images, in the same order."),
    ],
    centre_sd_px: Annotated[
        float,
        Query(
            ge=0.001,
            le=5,
            allow_inf_nan=False,
            description="Standard deviation of the image points per axis, px.",
        ),
    ] = 0.1,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the points that given image points show, with their deviations (SPACO of the thesis, section 5.5)."""
    if len(left) != len(right):
        error = ParameterError(
            f"{len(left)} left and {len(right)} right image points were given; give both of each point"
        )
        raise InvalidInputError("right", error, part="query")
    with database.read() as session:
        rig = rig_from_dict(calibrations.get(session, calibration_id).rig)
    images = _pixels("left", left, rig.left), _pixels("right", right, rig.right)
    covariance = np.tile(centre_sd_px**2 * np.eye(2), (len(left), 1, 1))
    cameras = ((rig.left, images[0]), (rig.right, images[1]))
    found = _points([camera.rays(np.array(pixels), covariance) for camera, pixels in cameras], rig)
    answer = Points.of(found, images, f"object space of calibration {rig.name}", centre_sd_px)
    return document_response(answer, if_none_match)


def _points(rays: list[Rays], rig: Rig) -> Triangulation:
    """Return the points; raise ``InvalidInputError`` unless all rays meet in front of both cameras."""
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        found = triangulate(rays)
        X, variances = found.position_mm, np.diagonal(found.covariance_mm2, axis1=1, axis2=2)
        known = np.isfinite(variances).all() and (variances > 0).all()
        if known and all(camera.depth_mm(point) > 0 for camera in (rig.left, rig.right) for point in X):
            return found
    error = ParameterError(
        "the rays of an image pair do not meet in front of the cameras; give the two images of one point"
    )
    raise InvalidInputError("right", error, part="query")


def _pixels(side: str, texts: list[str], camera: Camera) -> list[list[float]]:
    """Return image points; raise ``InvalidInputError`` for one outside the image, where no ray is known."""
    points = [[float(number) for number in text.split(",")] for text in texts]
    width, height = camera.image_size_px
    for u, v in points:
        if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
            error = ParameterError(
                f"({u:g}, {v:g}) lies outside the {side} image of {width} x {height} px; give u,v in its pixels"
            )
            raise InvalidInputError(side, error, part="query")
    return points
