"""A stereo pair as it arrives: its form, and what can be checked without decoding a pixel."""

from __future__ import annotations

from typing import Annotated

from fastapi import UploadFile
from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema

from contract.base import Identifier, StageName, TextTime
from service.problems import InvalidInputError
from spinewatch.errors import ImageError, ImageSizeError, SameImageError
from spinewatch.imaging.header import inspect_image
from store.images import NewImage
from store.tables import Calibration

File = Annotated[UploadFile, WithJsonSchema({"type": "string", "format": "binary"})]
"""An uploaded file; the format is what the API page knows a file chooser by."""


class StageForm(BaseModel):
    """The parts of the multipart form."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: StageName
    calibration_id: Annotated[Identifier, Field(description="The rig that the pair was taken with.")]
    left: Annotated[File, Field(description="Left picture: PNG, TIFF, JPEG or Sun raster.")]
    right: Annotated[File, Field(description="Right picture of the same moment.")]
    captured_at: Annotated[
        TextTime | None, Field(description="When the pair was taken: RFC 3339 with a zone.")
    ] = None


def read_pair(form: StageForm) -> tuple[NewImage, NewImage]:
    """Return both pictures with their headers checked; raise ``InvalidInputError`` naming the part."""
    left, right = read_picture("left", form.left), read_picture("right", form.right)
    if left.content == right.content:
        raise InvalidInputError(
            "right", SameImageError("left and right are the same picture; send the left and the right one")
        )
    return left, right


def require_calibrated_sizes(left: NewImage, right: NewImage, calibration: Calibration) -> None:
    """Raise ``InvalidInputError`` unless each picture has the size that its camera was calibrated with."""
    for side, image in (("left", left), ("right", right)):
        width, height = calibration.rig[side]["image_size_px"]
        if image.header.size != (width, height):
            error = ImageSizeError(
                f"the picture is {image.header.width} x {image.header.height} px, but its camera was"
                f" calibrated at {width} x {height} px; send a picture and a calibration that belong together"
            )
            raise InvalidInputError(side, error)


def read_picture(field: str, upload: UploadFile, index: int | None = None) -> NewImage:
    """Return a picture with its header checked; raise ``InvalidInputError`` naming the part."""
    content = upload.file.read()
    try:
        return NewImage(content, inspect_image(content))
    except ImageError as error:
        raise InvalidInputError(field, error, index) from error
