"""The form of a stage: a stereo pair and what it belongs to."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from contract.base import Identifier, StageName
from service.forms.images import File, read_image
from service.parameters import TextTime
from service.problems import InvalidInputError
from spinewatch.errors import ImageSizeError, SameImageError
from store.images import NewImage
from store.tables import Calibration


class StageForm(BaseModel):
    """Parts of the multipart form."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: StageName
    calibration_id: Annotated[
        Identifier, Field(description="Calibration of the cameras that took the images.")
    ]
    left: Annotated[File, Field(description="Left image: PNG, TIFF, JPEG or Sun raster.")]
    right: Annotated[File, Field(description="Right image, taken at the same time.")]
    captured_at: Annotated[
        TextTime | None, Field(description="Time of capture, RFC 3339 with a time zone.")
    ] = None


def read_pair(form: StageForm) -> tuple[NewImage, NewImage]:
    """Return both images with their headers checked; raises ``InvalidInputError``, which names the part."""
    left, right = read_image("left", form.left), read_image("right", form.right)
    if left.content == right.content:
        raise InvalidInputError(
            "right", SameImageError("left and right are the same image; send the left and the right one")
        )
    return left, right


def require_calibrated_sizes(left: NewImage, right: NewImage, calibration: Calibration) -> None:
    """Raise ``InvalidInputError`` unless each image has the size that its camera is calibrated for."""
    for side, image in (("left", left), ("right", right)):
        width, height = calibration.rig[side]["image_size_px"]
        if image.header.size != (width, height):
            error = ImageSizeError(
                f"the image is {image.header.width} x {image.header.height} px, but its camera is calibrated for"
                f" {width} x {height} px; send the calibration of the cameras that took the images"
            )
            raise InvalidInputError(side, error)
