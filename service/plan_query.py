"""Query parameters of plans: the rig, the marker, and the triads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import Query

from service.problems import InvalidInputError
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError, RigError
from spinewatch.levels import LevelError, vertebra_names
from spinewatch.markers import TriadModel, flat_triad
from spinewatch.planning.plan import PlanParameters, planned_heights
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.rig_files.rig_json import rig_from_dict
from store import calibrations
from store.database import Database

MAX_VERTEBRAE = 24
_EXTRA_LEVELS = ("T13", "L6")
_LEVEL = "[CTLS][1-9][0-9]?"


def _between(low: float, high: float, description: str) -> Any:
    """Return the declaration of a number of a query."""
    return Query(ge=low, le=high, allow_inf_nan=False, description=description)


@dataclass(frozen=True)
class RigQuery:
    """The rig of a plan: a stored calibration, or two equal cameras that are to be built."""

    calibration_id: Annotated[
        str | None,
        Query(min_length=1, max_length=64, description="Calibration whose rig is planned with."),
    ] = None
    baseline_mm: Annotated[
        float | None, _between(50, 5000, "Instead: distance between the cameras, mm; 422 if not given.")
    ] = None
    camera_height_mm: Annotated[
        float | None,
        _between(100, 5000, "Height of the cameras where their axes meet, mm; 736 if not given."),
    ] = None
    focal_length_mm: Annotated[float | None, _between(1, 500, "Focal length, mm; 7.7 if not given.")] = None
    image_width_px: Annotated[
        int | None, Query(ge=64, le=20000, description="Width of the images, px; 568 if not given.")
    ] = None
    image_height_px: Annotated[
        int | None, Query(ge=64, le=20000, description="Height of the images, px; 416 if not given.")
    ] = None
    pixel_width_mm: Annotated[
        float | None, _between(0.0005, 0.1, "Width of a pixel on the plate, mm; 0.01 if not given.")
    ] = None
    pixel_height_mm: Annotated[
        float | None, _between(0.0005, 0.1, "Height of a pixel on the plate, mm; 0.00845 if not given.")
    ] = None

    def require_calibration_alone(self) -> None:
        """Raise ``InvalidInputError`` if a calibration is given together with a rig that is to be built."""
        for name, value in vars(self).items():
            if name != "calibration_id" and value is not None:
                error = ParameterError("a calibration already says this of its rig; give one of the two")
                raise InvalidInputError(name, error, part="query")

    def planned(self) -> Rig:
        """Return the rig that is to be built; raises ``InvalidInputError`` if it is not plausible."""
        width, height = self.image_width_px or 568, self.image_height_px or 416
        pixel = (self.pixel_width_mm or 0.01, self.pixel_height_mm or 0.00845)
        try:
            return planned_rig(
                self.baseline_mm or 422.0,
                self.camera_height_mm or 736.0,
                self.focal_length_mm or 7.7,
                (width, height),
                pixel,
            )
        except RigError as error:
            raise InvalidInputError(error.field, error, part="query") from error


def rig_of(query: RigQuery, database: Database) -> Rig:
    """Return the rig of a plan: of the calibration that is named, or the planned one."""
    if query.calibration_id is None:
        return query.planned()
    query.require_calibration_alone()
    with database.read() as session:
        return rig_from_dict(calibrations.get(session, query.calibration_id).rig)


@dataclass(frozen=True)
class MarkerQuery:
    """The marker of a plan: the lengths of its legs, or a disc in which the best one is found."""

    xx_mm: Annotated[float, _between(2, 100, "Leg from P to the ball XX, mm.")] = 18.0
    yy_mm: Annotated[float, _between(2, 100, "Leg from P to the ball YY, mm.")] = 14.0
    mx_mm: Annotated[float, _between(2, 100, "Leg from P to the ball MX, mm.")] = 10.0
    ball_diameter_mm: Annotated[float, _between(1, 30, "Diameter of the balls, mm.")] = 8.0
    disc_radius_mm: Annotated[
        float | None,
        _between(5, 100, "Instead of legs: the best marker with its balls on the rim of a disc, mm."),
    ] = None

    def legs(self) -> TriadModel:
        """Return the marker with the given legs; raises ``InvalidInputError`` if its balls cannot be told apart."""
        try:
            return flat_triad(self.xx_mm, self.yy_mm, self.mx_mm, self.ball_diameter_mm)
        except ParameterError as error:
            raise InvalidInputError("xx_mm", error, part="query") from error


@dataclass(frozen=True)
class TriadsQuery:
    """Where the triads of a plan are, and how well their balls are measured."""

    levels: Annotated[
        str,
        Query(
            pattern=f"^{_LEVEL}(,{_LEVEL}){{0,{MAX_VERTEBRAE - 1}}}$",
            max_length=4 * MAX_VERTEBRAE,
            description="Vertebrae with a triad, the reference first.",
        ),
    ] = "L1,T11,T9,T7"
    spacing_mm: Annotated[float, _between(1, 200, "Distance between neighbours, mm.")] = 50.0
    spine_axis: Annotated[Literal["x", "y"], Query(description="Object axis along the spine.")] = "x"
    centre_sd_px: Annotated[
        float, _between(0.001, 5, "Standard deviation of a ball's centre, per axis, px.")
    ] = 0.1
    common_sd_mrad: Annotated[
        float,
        _between(0, 5, "Standard deviation of the pointing error that the balls of a triad share, mrad."),
    ] = PlanParameters.common_sd_mrad

    def parameters(self, heights_mm: tuple[float, ...]) -> PlanParameters:
        """Return the library's parameters; raises ``InvalidInputError`` for names that are no vertebrae."""
        try:
            names = vertebra_names(self.levels.split(","), _EXTRA_LEVELS)
        except LevelError as error:
            raise InvalidInputError("levels", error, part="query") from error
        return PlanParameters(
            vertebrae=names,
            spacing_mm=self.spacing_mm,
            spine_axis="xy".index(self.spine_axis),
            sigma_px=self.centre_sd_px,
            common_sd_mrad=self.common_sd_mrad,
            heights_mm=heights_mm,
        )


@dataclass(frozen=True)
class DepthQuery:
    """The range of depth of a plan."""

    depth_from_mm: Annotated[
        float, _between(-2000, 2000, "Lowest height above the point where the axes meet, mm.")
    ] = -60.0
    depth_to_mm: Annotated[
        float, _between(-2000, 2000, "Highest height above the point where the axes meet, mm.")
    ] = 60.0
    planes: Annotated[
        int, Query(ge=2, le=25, description="Number of heights between these, ends included.")
    ] = 7

    def heights_mm(self) -> tuple[float, ...]:
        """Return the heights, lowest first, mm; raises ``InvalidInputError`` if the ends are exchanged."""
        try:
            return planned_heights((self.depth_from_mm, self.depth_to_mm), self.planes)
        except ParameterError as error:
            raise InvalidInputError("depth_from_mm", error, part="query") from error
