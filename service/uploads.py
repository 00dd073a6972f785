"""A stereo pair as it arrives: its form, and what can be checked without decoding a pixel."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import UploadFile
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue

from service.problems import InvalidInputError
from service.schema import Identifier, StageName
from spinewatch.errors import ImageError, ImageSizeError, SameImageError
from spinewatch.formats.image_header import inspect_image
from store.images import NewImage
from store.tables import Calibration

_FILE: dict[str, JsonValue] = {"format": "binary"}  # what the API page knows a file chooser by
_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt]\d\d:\d\d:\d\d(\.\d{1,6})?([Zz]|[+-]\d\d:\d\d)", re.ASCII)


def _rfc_3339(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if not _RFC_3339.fullmatch(value):
        raise ValueError("not an RFC 3339 time with a zone; write it like 2026-11-21T09:30:00Z")
    try:
        return datetime.fromisoformat(value.upper()).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("outside the years 1 to 9999") from error


class StageForm(BaseModel):
    """The parts of the multipart form."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: StageName
    calibration_id: Annotated[Identifier, Field(description="The rig that the pair was taken with.")]
    left: Annotated[
        UploadFile, Field(description="Left picture: PNG, TIFF, JPEG or Sun raster.", json_schema_extra=_FILE)
    ]
    right: Annotated[
        UploadFile, Field(description="Right picture of the same moment.", json_schema_extra=_FILE)
    ]
    captured_at: Annotated[
        datetime | None,
        BeforeValidator(_rfc_3339),
        Field(description="When the pair was taken: RFC 3339 with a zone."),
    ] = None


def read_pair(form: StageForm) -> tuple[NewImage, NewImage]:
    """Return both pictures with their headers checked; raise ``InvalidInputError`` naming the part."""
    left, right = _picture("left", form.left), _picture("right", form.right)
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


def _picture(side: str, upload: UploadFile) -> NewImage:
    content = upload.file.read()
    try:
        return NewImage(content, inspect_image(content))
    except ImageError as error:
        raise InvalidInputError(side, error) from error
