"""The form of a radiograph: an image file, its view, its sides and its pixel spacing."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from contract.radiograph import ImageSide
from service.forms.images import File
from service.problems import InvalidInputError
from service.radiograph_process import read_apart
from spinewatch.errors import ImageError, SpinewatchError
from spinewatch.imaging.header import ImageHeader
from spinewatch.imaging.pixel_spacing import (
    LARGEST_SPACING_RATIO,
    MAX_SPACING_MM,
    MIN_SPACING_MM,
    SpacingSource,
    plausible_spacing,
)
from spinewatch.imaging.radiograph_image import RadiographImage
from spinewatch.imaging.stated_view import require_view
from spinewatch.numbers import parse_number
from store.images import NewImage
from store.radiographs import NewRadiograph

_NUMBER = r"[0-9]{1,3}(\.[0-9]{1,12})?"


class PixelSpacingMissingError(SpinewatchError):
    """Neither the form nor the file has the pixel spacing."""

    code = "pixel-spacing-missing"


def parse_spacing(text: str) -> tuple[float, float]:
    """Return rows and columns of ``0.143,0.143``, mm; raises ``ValueError`` unless they are those of a radiograph."""
    spacing = plausible_spacing([parse_number(number) for number in text.split(",")])
    if spacing is None:
        raise ValueError(
            f"must be two numbers from {MIN_SPACING_MM} to {MAX_SPACING_MM} mm, the larger at most"
            f" {LARGEST_SPACING_RATIO:g} times the smaller"
        )
    return spacing


def _require_spacing(text: str) -> str:
    parse_spacing(text)
    return text


SpacingText = Annotated[
    str,
    Field(pattern=f"^{_NUMBER},{_NUMBER}$", examples=["0.143,0.143"]),
    AfterValidator(_require_spacing),
]


class RadiographForm(BaseModel):
    """Parts of the multipart form."""

    model_config = ConfigDict(strict=True, extra="forbid")

    view: Annotated[Literal["pa", "lateral"], Field(description="pa or lateral.")]
    image: Annotated[
        File,
        Field(
            description="PNG, JPEG, TIFF or uncompressed DICOM, with the head at the top. Only gray levels and pixel"
            " spacing are kept. What a DICOM file says of its view and sides must agree with the form."
        ),
    ]
    pixel_spacing_mm: Annotated[
        SpacingText | None,
        Field(
            description="Distance of rows and of columns at the patient, mm: row,column. Required unless a DICOM file"
            " has it; takes precedence over the file's."
        ),
    ] = None
    left_on: Annotated[
        ImageSide | None,
        Field(description="Side of the image on which the patient's left lies; required for pa."),
    ] = None
    anterior_on: Annotated[
        ImageSide | None,
        Field(description="Side of the image on which the patient's front lies; required for lateral."),
    ] = None

    @model_validator(mode="after")
    def _one_side(self) -> Self:
        wanted, other = ("left_on", "anterior_on") if self.view == "pa" else ("anterior_on", "left_on")
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            raise ValueError(f"give {wanted} for a {self.view} view, and not {other}")
        return self


def read_new_radiograph(form: RadiographForm) -> NewRadiograph:
    """Return the radiograph without the metadata of its file; raises ``InvalidInputError``, which names the part."""
    positive_on = form.left_on or form.anterior_on or "left"
    try:
        found = read_apart(form.image.file)
        require_view(found.stated_view, form.view, positive_on)
    except ImageError as error:
        raise InvalidInputError("image", error) from error
    spacing, source = _spacing(form, found)
    return NewRadiograph(
        view=form.view,
        positive_on=positive_on,
        pixel_spacing_mm=spacing,
        spacing_source=source,
        image=NewImage(found.png, ImageHeader("PNG", "image/png", found.width, found.height)),
    )


def _spacing(form: RadiographForm, found: RadiographImage) -> tuple[tuple[float, float], SpacingSource]:
    if form.pixel_spacing_mm is not None:
        return parse_spacing(form.pixel_spacing_mm), SpacingSource.GIVEN
    if found.pixel_spacing_mm is None or found.spacing_source is None:
        error = PixelSpacingMissingError(
            "the file does not state its pixel spacing; give the distance of rows and columns at the patient in mm, for"
            " example pixel_spacing_mm=0.143,0.143, from an object of known size in the image"
        )
        raise InvalidInputError("pixel_spacing_mm", error)
    return found.pixel_spacing_mm, found.spacing_source
