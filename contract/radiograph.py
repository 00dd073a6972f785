"""Radiographs of a surgery, and how their landmarks fit to object space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from contract.base import Identifier, Matrix3, Schema, StageName, Timestamp, Vector2, Vector3
from contract.flag import Flag
from contract.image import Image
from contract.spine_setup import InitialRadiographs, VertebraLandmarks
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.spine.radiograph_landmarks import CommonPoint, LandmarkedVertebra

if TYPE_CHECKING:
    from spinewatch.spine.radiographs import RadiographFit as LibraryFit
    from spinewatch.triads.pose import Pose

RadiographKind = Literal["pa", "lateral"]
ImageSide = Literal["left", "right"]


class Radiograph(Schema):
    """A radiograph as it is stored: gray levels as PNG, without the metadata of the uploaded file."""

    id: Annotated[Identifier, Field(description="Identifier of the radiograph.")]
    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    view: Annotated[RadiographKind, Field(description="pa, from behind or in front, or lateral.")]
    positive_on: Annotated[
        ImageSide,
        Field(description="Side of the image on which the patient's left (pa) or front (lateral) lies."),
    ]
    pixel_spacing_mm: Annotated[Vector2, Field(description="Distance of rows and of columns, mm.")]
    spacing_source: Annotated[
        SpacingSource,
        Field(
            description="given with the upload, or from the DICOM file: pixel_spacing, at the patient, or"
            " imager_pixel_spacing, at the detector, where the patient appears magnified."
        ),
    ]
    image: Annotated[Image, Field(description="The stored image.")]
    created_at: Timestamp


class NewRadiographFit(Schema):
    """Landmarks whose fit is to be tried."""

    initial: Annotated[InitialRadiographs, Field(description="The landmarks, as in the setup of a spine.")]
    stage: Annotated[
        StageName | None,
        Field(description="Stage whose triads common landmarks name; null if none names a triad."),
    ] = None


class LandmarkResidual(Schema):
    """How a common landmark fits."""

    name: Annotated[str, Field(description="Name of the landmark.")]
    residual_mm: Annotated[
        Vector3, Field(description="Its place in object space minus its place by the radiographs, mm.")
    ]
    distance_mm: Annotated[float, Field(description="Length of that, mm.")]
    doubtful: Annotated[bool, Field(description="Whether it fits worst, and worse than its error explains.")]


class RadiographFit(Schema):
    """The seven-parameter fit of the radiographs to object space, and how the two views agree."""

    scale: Annotated[float, Field(description="Scale; 1 if the pixel spacings are those at the patient.")]
    scale_sd: Annotated[float, Field(description="Its standard deviation.")]
    rotation: Annotated[
        Matrix3,
        Field(description="Rotation to object axes from those of the radiographs: anterior, left, cephalad."),
    ]
    tilt_sd_deg: Annotated[
        Vector3, Field(description="Standard deviations of the rotation about the object axes, degrees.")
    ]
    translation_mm: Annotated[
        Vector3,
        Field(description="Object coordinates of the origin of the radiographs, their pixels (0, 0), mm."),
    ]
    translation_sd_mm: Annotated[
        Vector3,
        Field(description="Standard deviations of the translation at the centroid of the landmarks, mm."),
    ]
    residuals: Annotated[list[LandmarkResidual], Field(description="Residual of each common landmark.")]
    rms_mm: Annotated[float, Field(description="Root mean square of the residuals' lengths, mm.")]
    left_out: Annotated[
        list[str], Field(description="Common landmarks whose triad the stage has no pose of.")
    ]
    height_offset_mm: Annotated[
        float, Field(description="Height in the PA view minus height in the lateral view, mm.")
    ]
    height_rms_mm: Annotated[
        float, Field(description="Root mean square of what the heights differ by besides, mm.")
    ]
    enlargement: Annotated[
        float,
        Field(description="Factor by which deviations are enlarged because the landmarks disagree, from 1."),
    ]
    flags: Annotated[list[Flag], Field(description="What is doubtful.")]

    @classmethod
    def of(cls, fit: LibraryFit, left_out: Sequence[str] = ()) -> RadiographFit:
        """Return the contract model of the library's fit."""
        similarity = fit.similarity
        return cls.model_validate(
            {
                "scale": similarity.transform.scale,
                "scale_sd": similarity.scale_sd,
                "rotation": similarity.transform.rotation,
                "tilt_sd_deg": similarity.rotation_sd_deg,
                "translation_mm": similarity.transform.translation_mm,
                "translation_sd_mm": similarity.translation_sd_mm,
                "residuals": [
                    {
                        "name": point.name,
                        "residual_mm": point.residual_mm,
                        "distance_mm": point.distance_mm,
                        "doubtful": point.blunder,
                    }
                    for point in similarity.residuals
                ],
                "rms_mm": similarity.rms_mm,
                "left_out": list(left_out),
                "height_offset_mm": fit.heights.offset_mm,
                "height_rms_mm": fit.heights.rms_mm,
                "enlargement": fit.enlargement,
                "flags": Flag.of(fit.flags),
            }
        )


def landmarked_vertebra(landmarks: VertebraLandmarks) -> LandmarkedVertebra:
    """Return the library's landmarks of a vertebra; a single pedicle is left out."""
    pa, lateral = landmarks.pa, landmarks.lateral
    pedicles = None
    if pa.pedicle_left is not None and pa.pedicle_right is not None:
        pedicles = np.array([pa.pedicle_left, pa.pedicle_right])
    return LandmarkedVertebra(
        landmarks.vertebra,
        np.array([pa.superior_left, pa.superior_right, pa.inferior_left, pa.inferior_right]),
        np.array(
            [
                lateral.superior_anterior,
                lateral.superior_posterior,
                lateral.inferior_anterior,
                lateral.inferior_posterior,
            ]
        ),
        pedicles,
    )


def common_points(
    initial: InitialRadiographs, triads: Mapping[str, Pose]
) -> tuple[list[CommonPoint], list[str]]:
    """Return the library's common points, and the names of those whose triad has no pose."""
    points, left_out = [], []
    for landmark in initial.common:
        pose = None if landmark.triad is None else triads.get(landmark.triad)
        if landmark.object_mm is not None:
            place, covariance = np.array(landmark.object_mm), landmark.object_sd_mm**2 * np.eye(3)
        elif pose is not None:
            place, covariance = pose.position_mm, pose.covariance[:3, :3]
        else:
            left_out.append(landmark.name)
            continue
        points.append(
            CommonPoint(landmark.name, np.array(landmark.pa), np.array(landmark.lateral), place, covariance)
        )
    return points, left_out
