"""The form of a calibration from images: shots of a control field and options."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Self

from fastapi import UploadFile
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from contract.text import visible
from service.forms.control_field import read_control_field
from service.forms.images import File, read_image
from service.forms.options import FixText, FreeText, PixelSizeText, parse_fix, parse_free, parse_pixel_size
from service.parameters import TextTime
from service.problems import InvalidInputError
from spinewatch.errors import ImageError, ImageSizeError, SameImageError
from spinewatch.imaging.header import MAX_PIXELS
from store.calibration_requests import NewRequest, NewShot
from store.images import NewImage
from store.tables.base import Document

MAX_SHOTS = 20
_MAX_TOTAL_PIXELS = 2 * MAX_PIXELS

Images = Annotated[list[File], Field(min_length=1, max_length=MAX_SHOTS)]


class CalibrationForm(BaseModel):
    """Parts of the multipart form; the options are those of ``spinewatch calibrate``."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: Annotated[
        str, Field(min_length=1, max_length=200, description="Name of the rig."), AfterValidator(visible)
    ]
    control_field: Annotated[
        File | Annotated[str, Field(min_length=1)],
        Field(
            description="Built-in name pegboard-1995, or CSV id,x_mm,y_mm,z_mm as a file or as text, or a flat board in"
            " several tilted shots: chessboard:9x6:25 or charuco:7x5:40:30:DICT_5X5_100."
        ),
    ]
    left: Annotated[Images, Field(description="Left images, one per shot.")]
    right: Annotated[Images, Field(description="Right images, in the same order.")]
    verify: Annotated[
        int, Field(strict=False, ge=0, description="Number of trailing shots held out for verification.")
    ] = 0
    captured_at: Annotated[
        TextTime | None,
        Field(description="Time of capture, RFC 3339 with a time zone; by default the time of the request."),
    ] = None
    pixel_size: Annotated[
        PixelSizeText | None,
        Field(description="Width and height of a pixel, mm; by default those of the cart."),
    ] = None
    free: Annotated[
        FreeText | None,
        Field(description="Interior parameters to adjust; by default those that the points determine."),
    ] = None
    fix: Annotated[
        FixText | None, Field(description="Interior parameters held fixed, in the units of the rig.")
    ] = None
    estimate_aspect: Annotated[
        bool,
        Field(
            strict=False,
            description="Also adjust the aspect ratio of the pixels; targets are then identified without it.",
        ),
    ] = False

    @model_validator(mode="after")
    def _require_pairs(self) -> Self:
        if len(self.left) != len(self.right):
            raise ValueError(
                f"{len(self.left)} left and {len(self.right)} right images; send both of every shot"
            )
        if self.verify >= len(self.left):
            raise ValueError(
                f"verify is {self.verify} of {len(self.left)} shots; leave at least one to calibrate with"
            )
        return self


def read_request(form: CalibrationForm) -> NewRequest:
    """Return the requested calibration with all headers checked; raises ``InvalidInputError``, which names the part."""
    left, right = _read_images("left", form.left), _read_images("right", form.right)
    _require_distinct(left, right)
    _require_one_size("left", left)
    _require_one_size("right", right)
    _require_bounded_total([*left, *right])
    field, points = read_control_field(form.control_field)
    used = len(left) - form.verify
    return NewRequest(
        name=form.name,
        control_field=field,
        control_points=points,
        options=_options(form),
        shots=[
            NewShot(*pair, used=number < used) for number, pair in enumerate(zip(left, right, strict=True))
        ],
        captured_at=form.captured_at,
    )


def _options(form: CalibrationForm) -> Document:
    return {
        "pixel_size_mm": list(parse_pixel_size(form.pixel_size)) if form.pixel_size else None,
        "free": parse_free(form.free) if form.free else None,
        "fixed": parse_fix(form.fix) if form.fix else {},
        "estimate_aspect": form.estimate_aspect,
    }


def _read_images(side: str, uploads: Sequence[UploadFile]) -> list[NewImage]:
    return [read_image(side, upload, index) for index, upload in enumerate(uploads)]


def _require_distinct(left: Sequence[NewImage], right: Sequence[NewImage]) -> None:
    first: dict[str, str] = {}
    for index, pair in enumerate(zip(left, right, strict=True)):
        for side, image in zip(("left", "right"), pair, strict=True):
            position = f"{side} {index + 1}"
            same = first.setdefault(image.sha256, position)
            if same != position:
                error = SameImageError(f"the same image as {same}; send each image once")
                raise InvalidInputError(side, error, index)


def _require_one_size(side: str, images: Sequence[NewImage]) -> None:
    first = images[0].header
    for index, image in enumerate(images):
        if image.header.size != first.size:
            error = ImageSizeError(
                f"{image.header.width} x {image.header.height} px, but the first is {first.width} x {first.height}"
                " px; all shots must come from the same two cameras"
            )
            raise InvalidInputError(side, error, index)


def _require_bounded_total(images: Sequence[NewImage]) -> None:
    if sum(image.header.width * image.header.height for image in images) > _MAX_TOTAL_PIXELS:
        error = ImageError(
            f"all images together have more than {_MAX_TOTAL_PIXELS // 1_000_000} million pixels; send fewer shots"
        )
        raise InvalidInputError("left", error)
