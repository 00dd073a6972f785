"""The setup of a spine: what must be known of a surgery to interpret its triads as a spine."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from contract.base import Identifier, Matrix3, Schema, StageName, Timestamp, Vector2, Vector3
from contract.surgery import VertebraName
from contract.text import visible_if_new
from spinewatch.arrays import Float
from spinewatch.spine.axes_errors import direction_axes_covariance, landmark_axes_covariance
from spinewatch.spine.patient_axes import axes_from_directions, axes_from_landmarks
from spinewatch.spine.target import PlannedVertebra

POSITION_SD_MM = 2.0
ROTATION_SD_DEG = 3.0
"""Standard deviations of an initial pose that is given without: those of landmarks and angles read from radiographs."""

DIRECTION_SD_DEG = 3.0
LANDMARK_SD_MM = 7.0
"""Standard deviations of the patient axes that are given without; docs/spine.md says where they come from."""

SignedAxis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Direction = Annotated[
    SignedAxis | Vector3,
    Field(
        description="Direction in object space: a signed axis, or a vector of any length.", examples=["-x"]
    ),
]


class PatientDirections(Schema):
    """Patient axes by two directions in object space of the baseline stage."""

    kind: Annotated[Literal["directions"], Field(description="Two directions.")]
    cephalad: Annotated[Direction, Field(description="Direction to the head.")]
    left: Annotated[Direction, Field(description="Direction to the patient's left.")]
    direction_sd_deg: Annotated[
        float,
        Field(
            ge=0,
            le=45,
            description="Standard deviation of each direction about the axes perpendicular to it, degrees; 0 means that"
            f" it is not known, and counts as {DIRECTION_SD_DEG:g} degrees.",
        ),
    ] = DIRECTION_SD_DEG

    @field_validator("direction_sd_deg")
    @classmethod
    def _direction_sd(cls, given: float) -> float:
        return given or DIRECTION_SD_DEG


class PatientLandmarks(Schema):
    """Patient axes by three points in object space of the baseline stage."""

    kind: Annotated[Literal["landmarks"], Field(description="Three landmarks.")]
    caudal_mm: Annotated[Vector3, Field(description="A point on the midline, mm.")]
    cephalad_mm: Annotated[Vector3, Field(description="A point on the midline nearer the head, mm.")]
    left_mm: Annotated[Vector3, Field(description="A point to the patient's left of the midline, mm.")]
    landmark_sd_mm: Annotated[
        float,
        Field(
            ge=0,
            le=100,
            description="Standard deviation of each point per axis, mm; 0 means that it is not known, and counts as"
            f" {LANDMARK_SD_MM:g} mm.",
        ),
    ] = LANDMARK_SD_MM

    @field_validator("landmark_sd_mm")
    @classmethod
    def _landmark_sd(cls, given: float) -> float:
        return given or LANDMARK_SD_MM


PatientAxes = Annotated[PatientDirections | PatientLandmarks, Field(discriminator="kind")]


class VertebraPose(Schema):
    """The pose of a vertebral body, as typed in: either a rotation matrix or three angles."""

    vertebra: VertebraName
    position_mm: Annotated[Vector3, Field(description="Centroid of the body, mm; within 10 m.")]
    rotation: Annotated[
        Matrix3 | None,
        Field(
            description="Rotation matrix; its columns are the vertebra's anterior, left and cephalad axes."
        ),
    ] = None
    angles_deg: Annotated[
        Vector3 | None,
        Field(
            description="Coronal tilt, sagittal tilt and axial rotation in patient axes, degrees; from -90 to 90."
        ),
    ] = None
    position_sd_mm: Annotated[
        float,
        Field(
            ge=0,
            le=100,
            description="Standard deviation of the position per axis, mm; 0 means that it is not known, and counts as"
            f" {POSITION_SD_MM:g} mm.",
        ),
    ] = POSITION_SD_MM
    rotation_sd_deg: Annotated[
        float,
        Field(
            ge=0,
            le=90,
            description="Standard deviation of the rotation per axis, degrees; 0 means that it is not known, and counts"
            f" as {ROTATION_SD_DEG:g} degrees.",
        ),
    ] = ROTATION_SD_DEG

    @field_validator("position_sd_mm")
    @classmethod
    def _position_sd(cls, given: float) -> float:
        return given or POSITION_SD_MM

    @field_validator("rotation_sd_deg")
    @classmethod
    def _rotation_sd(cls, given: float) -> float:
        return given or ROTATION_SD_DEG

    @model_validator(mode="after")
    def _one_rotation(self) -> Self:
        if (self.rotation is None) == (self.angles_deg is None):
            raise ValueError("give either rotation or angles_deg")
        return self


class InitialPoses(Schema):
    """An initial configuration that was typed in or uploaded."""

    kind: Annotated[Literal["poses"], Field(description="Vertebra poses.")]
    frame: Annotated[
        Literal["object", "patient"],
        Field(
            description="Axes of the poses: object space of the baseline stage, or patient axes of any origin, which is"
            " then placed by the triads."
        ),
    ]
    poses: Annotated[list[VertebraPose], Field(min_length=2, max_length=30, description="One per vertebra.")]


class FrontalLandmarks(Schema):
    """Landmarks of one vertebra in the PA radiograph, (u, v) in px; sides are the patient's."""

    superior_left: Annotated[Vector2, Field(description="Left end of the upper end plate.")]
    superior_right: Annotated[Vector2, Field(description="Right end of the upper end plate.")]
    inferior_left: Annotated[Vector2, Field(description="Left end of the lower end plate.")]
    inferior_right: Annotated[Vector2, Field(description="Right end of the lower end plate.")]
    pedicle_left: Annotated[Vector2 | None, Field(description="Centre of the left pedicle.")] = None
    pedicle_right: Annotated[Vector2 | None, Field(description="Centre of the right pedicle.")] = None


class LateralLandmarks(Schema):
    """Landmarks of one vertebra in the lateral radiograph, (u, v) in px."""

    superior_anterior: Annotated[Vector2, Field(description="Anterior end of the upper end plate.")]
    superior_posterior: Annotated[Vector2, Field(description="Posterior end of the upper end plate.")]
    inferior_anterior: Annotated[Vector2, Field(description="Anterior end of the lower end plate.")]
    inferior_posterior: Annotated[Vector2, Field(description="Posterior end of the lower end plate.")]


class VertebraLandmarks(Schema):
    """Landmarks of one vertebra in both radiographs."""

    vertebra: VertebraName
    pa: Annotated[FrontalLandmarks, Field(description="Corners of the body and pedicles in the PA view.")]
    lateral: Annotated[LateralLandmarks, Field(description="Corners of the body in the lateral view.")]


class CommonLandmark(Schema):
    """A point that both the radiographs and the cameras show."""

    name: Annotated[
        str,
        Field(min_length=1, max_length=40, description="Name of the point."),
        AfterValidator(visible_if_new),
    ]
    pa: Annotated[Vector2, Field(description="The point in the PA radiograph (u, v), px.")]
    lateral: Annotated[Vector2, Field(description="The point in the lateral radiograph (u, v), px.")]
    object_mm: Annotated[
        Vector3 | None, Field(description="The point in object space of the baseline stage, mm.")
    ] = None
    object_sd_mm: Annotated[
        float, Field(ge=0, le=100, description="Standard deviation of object_mm per axis, mm.")
    ] = 0.0
    triad: Annotated[
        VertebraName | None, Field(description="Instead: the point P of this vertebra's triad.")
    ] = None

    @model_validator(mode="after")
    def _one_point(self) -> Self:
        if (self.object_mm is None) == (self.triad is None):
            raise ValueError("give either object_mm or triad")
        return self


class InitialRadiographs(Schema):
    """An initial configuration from landmarks on a PA and a lateral radiograph."""

    kind: Annotated[Literal["radiographs"], Field(description="Landmarks on two radiographs.")]
    pa: Annotated[Identifier, Field(description="Identifier of the PA radiograph.")]
    lateral: Annotated[Identifier, Field(description="Identifier of the lateral radiograph.")]
    vertebrae: Annotated[
        list[VertebraLandmarks],
        Field(min_length=2, max_length=30, description="Landmarks of each vertebra, in any order."),
    ]
    common: Annotated[
        list[CommonLandmark],
        Field(min_length=3, max_length=60, description="Points for the seven-parameter fit to object space."),
    ]
    landmark_sd_px: Annotated[
        float, Field(gt=0, le=50, description="Standard deviation of a digitised point per axis, px.")
    ] = 1.0


class InitialGeneric(Schema):
    """No initial configuration: a generic spine is fitted to the triads, and everything is marked assumed."""

    kind: Annotated[Literal["generic"], Field(description="A generic spine.")]
    cranial: Annotated[VertebraName, Field(description="The most cranial vertebra of it.")] = "T1"
    caudal: Annotated[VertebraName, Field(description="The most caudal vertebra of it.")] = "L5"


InitialConfiguration = Annotated[
    InitialPoses | InitialRadiographs | InitialGeneric, Field(discriminator="kind")
]


class TargetVertebra(Schema):
    """The planned pose of a vertebra in patient axes."""

    vertebra: VertebraName
    angles_deg: Annotated[
        Vector3, Field(description="Coronal tilt, sagittal tilt and axial rotation, degrees.")
    ]
    position_mm: Annotated[
        Vector3 | None,
        Field(
            description="Centroid in patient axes from the reference vertebra's centroid, mm; null if not planned."
        ),
    ] = None


class SpineSetup(Schema):
    """What must be known of a surgery to interpret its triads as a spine."""

    patient_axes: Annotated[PatientAxes, Field(description="How object space maps to the patient.")]
    levels: Annotated[
        list[VertebraName] | None,
        Field(max_length=30, description="Vertebrae with a marker; null for those of the surgery."),
    ] = None
    reference_vertebra: Annotated[
        VertebraName | None, Field(description="Vertebra of the reference triad; null for the surgery's.")
    ] = None
    baseline: Annotated[
        StageName | None,
        Field(
            description="Stage of the initial configuration; null for the first one of the surgery. No later one takes"
            " its place when it has no result or no pose of the reference triad."
        ),
    ] = None
    initial: Annotated[InitialConfiguration, Field(description="The initial configuration.")]
    target: Annotated[
        list[TargetVertebra] | None,
        Field(max_length=30, description="The planned configuration; every stage then reports what remains."),
    ] = None


class StoredSpineSetup(Schema):
    """A setup as it is stored; a change makes a new revision and keeps the former one."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    revision: Annotated[int, Field(ge=1, description="Number of the revision.")]
    created_at: Timestamp
    setup: Annotated[SpineSetup, Field(description="The setup.")]
    rebaselines: Annotated[list[StoredRebaseline], Field(description="Markers that were clamped again.")]


class NewRebaseline(Schema):
    """A marker that was clamped again while the spine did not move."""

    vertebra: VertebraName
    before: Annotated[StageName, Field(description="Last stage with the marker in its former place.")]
    after: Annotated[StageName, Field(description="First stage with it in its new place.")]


class StoredRebaseline(NewRebaseline):
    """A re-clamped marker as it is stored."""

    created_at: Timestamp


class SetupRevision(StoredSpineSetup):
    """A setup in the list of all revisions, with who stored it."""

    actor: Annotated[
        str | None,
        Field(description="Prefix and name of the key that stored it; null where no event says so."),
    ]


StoredSpineSetup.model_rebuild()
SetupRevision.model_rebuild()


def patient_axes(axes: PatientAxes) -> Float:
    """Return the rotation from patient axes to object axes of the baseline stage, shape (3, 3).

    Raises ``SpinewatchError`` when the directions or points determine none.
    """
    if isinstance(axes, PatientDirections):
        return axes_from_directions(_direction(axes.cephalad), _direction(axes.left))
    return axes_from_landmarks(np.array(axes.caudal_mm), np.array(axes.cephalad_mm), np.array(axes.left_mm))


def patient_axes_covariance(axes: PatientAxes) -> Float:
    """Return the covariance of a small rotation of the patient axes about themselves, shape (3, 3), degrees^2.

    Raises ``SpinewatchError`` when the directions or points determine none.
    """
    if isinstance(axes, PatientDirections):
        sd = axes.direction_sd_deg
        return direction_axes_covariance(_direction(axes.cephalad), _direction(axes.left), sd, sd)
    caudal, cephalad, left = (np.array(point) for point in (axes.caudal_mm, axes.cephalad_mm, axes.left_mm))
    return landmark_axes_covariance(caudal, cephalad, left, axes.landmark_sd_mm)


def planned_vertebrae(setup: SpineSetup) -> tuple[PlannedVertebra, ...] | None:
    """Return the library's target of a setup, None without one."""
    if setup.target is None:
        return None
    return tuple(
        PlannedVertebra(
            item.vertebra,
            np.array(item.angles_deg),
            None if item.position_mm is None else np.array(item.position_mm),
        )
        for item in setup.target
    )


def _direction(direction: Direction) -> Float:
    """Return a direction as a vector, shape (3,)."""
    if not isinstance(direction, str):
        return np.array(direction)
    sign = 1.0 if direction[0] == "+" else -1.0
    return np.array([sign if axis == direction[1] else 0.0 for axis in "xyz"])
