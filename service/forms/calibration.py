"""Shots of a control field as they arrive: their form, and what can be checked without decoding a pixel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Self

from fastapi import UploadFile
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from contract.base import TextTime
from service.forms.stage import File, read_picture
from service.problems import InvalidInputError
from spinewatch.errors import ImageError, ImageSizeError, SameImageError, SpinewatchError
from spinewatch.imaging.header import MAX_PIXELS
from store.calibration_requests import NewRequest, NewShot
from store.images import NewImage
from store.tables import Document

MAX_SHOTS = 20
_MAX_CSV_BYTES = 64 * 1024
_MAX_PIXELS_IN_ALL = 2 * MAX_PIXELS
INTERIOR = ("f", "x0", "y0", "K1", "K2", "P1", "P2")
"""Parameters that may be chosen; the library's own list is out of reach here."""
_NAME = "|".join(INTERIOR)
_NUMBER = r"[+-]?[0-9]{1,9}(\.[0-9]{1,15})?([eE][+-]?[0-9]{1,2})?"


class ControlFileError(SpinewatchError):
    """The file of a control field cannot be a CSV of points."""

    code = "invalid-control-field"


def _once_each(text: str) -> str:
    names = [item.partition("=")[0] for item in text.split(",")]
    if len(set(names)) < len(names):
        raise ValueError("names a parameter twice; name each once")
    return text


def _positive(text: str) -> str:
    if not all(float(number) > 0 for number in text.split(",")):
        raise ValueError("must be two positive numbers")
    return text


Files = Annotated[list[File], Field(min_length=1, max_length=MAX_SHOTS)]


class CalibrationForm(BaseModel):
    """The parts of the multipart form; the options are those of ``spinewatch calibrate``."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: Annotated[str, Field(min_length=1, max_length=200, description="Name of the rig.")]
    control_field: Annotated[
        File | Annotated[str, Field(min_length=1)],
        Field(description="A built-in name, pegboard-1995, or CSV id,x_mm,y_mm,z_mm as a file or as text."),
    ]
    left: Annotated[Files, Field(description="Left pictures in the order of the shots.")]
    right: Annotated[Files, Field(description="Right pictures in the same order.")]
    verify: Annotated[
        int, Field(strict=False, ge=0, description="The last so many shots only verify, they are not used.")
    ] = 0
    captured_at: Annotated[
        TextTime | None, Field(description="When the shots were taken: RFC 3339 with a zone; else now.")
    ] = None
    pixel_size: Annotated[
        str | None,
        Field(
            pattern=f"^{_NUMBER},{_NUMBER}$",
            description="Width and height of a pixel on the plate, mm; else the cart's.",
            examples=["0.01,0.00845"],
        ),
        AfterValidator(lambda text: text if text is None else _positive(text)),
    ] = None
    free: Annotated[
        str | None,
        Field(
            pattern=f"^({_NAME})(,({_NAME}))*$",
            description="Interior parameters to adjust; else chosen by what the points determine.",
            examples=["f,x0,y0,K1"],
        ),
        AfterValidator(lambda text: text if text is None else _once_each(text)),
    ] = None
    fix: Annotated[
        str | None,
        Field(
            pattern=f"^({_NAME})={_NUMBER}(,({_NAME})={_NUMBER})*$",
            description="Interior parameters held at a value, in the units of the rig.",
            examples=["x0=0,y0=0"],
        ),
        AfterValidator(lambda text: text if text is None else _once_each(text)),
    ] = None
    estimate_aspect: Annotated[
        bool,
        Field(
            strict=False, description="Adjust the pixels' aspect too; pictures are named without knowing it."
        ),
    ] = False

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if len(self.left) != len(self.right):
            raise ValueError(
                f"{len(self.left)} left and {len(self.right)} right pictures; send both of every shot"
            )
        if self.verify >= len(self.left):
            raise ValueError(
                f"verify is {self.verify} of {len(self.left)} shots; leave at least one to calibrate with"
            )
        return self


def read_request(form: CalibrationForm) -> NewRequest:
    """Return what is asked for with all headers checked; raise ``InvalidInputError`` naming the part."""
    left, right = (
        [read_picture(side, upload, index) for index, upload in enumerate(uploads)]
        for side, uploads in (("left", form.left), ("right", form.right))
    )
    _refuse_twice(left, right)
    for side, images in (("left", left), ("right", right)):
        _refuse_sizes(side, images)
    _refuse_too_many_pixels([*left, *right])
    used = len(left) - form.verify
    field, points = _control_field(form.control_field)
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
    fixed: dict[str, Any] = {}
    for item in form.fix.split(",") if form.fix else ():
        name, _, value = item.partition("=")
        fixed[name] = float(value)
    return {
        "pixel_size_mm": [float(n) for n in form.pixel_size.split(",")] if form.pixel_size else None,
        "free": form.free.split(",") if form.free else None,
        "fixed": fixed,
        "estimate_aspect": form.estimate_aspect,
    }


def _control_field(given: UploadFile | str) -> tuple[str, str | None]:
    """Return the name of a control field, and its CSV unless it is a built-in one."""
    if isinstance(given, str):
        if "\n" not in given:
            return given, None
        name, content = "control field", given.encode()
    else:
        name, content = (given.filename or "control field")[:200], given.file.read(_MAX_CSV_BYTES + 1)
    if len(content) > _MAX_CSV_BYTES:
        error = ControlFileError(
            f"more than {_MAX_CSV_BYTES} bytes; send the points as CSV id,x_mm,y_mm,z_mm"
        )
        raise InvalidInputError("control_field", error)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        error = ControlFileError("not a text file in UTF-8; send the points as CSV id,x_mm,y_mm,z_mm")
        raise InvalidInputError("control_field", error)
    return name, text


def _refuse_twice(left: Sequence[NewImage], right: Sequence[NewImage]) -> None:
    seen: dict[str, str] = {}
    for index, pair in enumerate(zip(left, right, strict=True)):
        for side, image in zip(("left", "right"), pair, strict=True):
            other = seen.setdefault(image.sha256, f"{side} {index + 1}")
            if other != f"{side} {index + 1}":
                raise InvalidInputError(
                    side, SameImageError(f"the same picture as {other}; send each picture once"), index
                )


def _refuse_sizes(side: str, images: Sequence[NewImage]) -> None:
    first = images[0].header
    for index, image in enumerate(images):
        if image.header.size != first.size:
            error = ImageSizeError(
                f"{image.header.width} x {image.header.height} px, but the first is {first.width} x {first.height}"
                " px; all shots must come from the same two cameras"
            )
            raise InvalidInputError(side, error, index)


def _refuse_too_many_pixels(images: Sequence[NewImage]) -> None:
    if sum(image.header.width * image.header.height for image in images) > _MAX_PIXELS_IN_ALL:
        error = ImageError(
            f"all pictures together have more than {_MAX_PIXELS_IN_ALL // 1_000_000} million pixels; send fewer shots"
        )
        raise InvalidInputError("left", error)
