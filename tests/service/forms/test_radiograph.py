"""The form of a radiograph: sides, spacing and files."""

import io
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from tempfile import SpooledTemporaryFile
from typing import Any, BinaryIO, cast

import numpy as np
import pytest
from fastapi import UploadFile
from PIL import Image
from pydantic import ValidationError

from service.forms.radiograph import RadiographForm, parse_spacing, read_new_radiograph
from service.problems import InvalidInputError
from spinewatch.imaging.pixel_spacing import SpacingSource
from tests.spinewatch.imaging.dicom_files import dicom

Form = Callable[..., RadiographForm]
GRAY = np.arange(12, dtype=np.uint8).reshape(3, 4)


def png() -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(GRAY).save(buffer, "PNG")
    return buffer.getvalue()


@pytest.fixture
def form() -> Iterator[Form]:
    with ExitStack() as files:

        def made(content: bytes, **fields: Any) -> RadiographForm:
            file = files.enter_context(SpooledTemporaryFile(max_size=1 << 20))
            file.write(content)
            file.seek(0)
            given = {"view": "pa", "left_on": "left", **fields}
            return RadiographForm(image=UploadFile(cast("BinaryIO", file)), **given)

        yield made


def test_the_spacing_of_a_form_takes_precedence(form: Form) -> None:
    given = read_new_radiograph(form(dicom(GRAY), pixel_spacing_mm="0.143,0.15"))
    assert (given.pixel_spacing_mm, given.spacing_source) == ((0.143, 0.15), SpacingSource.GIVEN)
    found = read_new_radiograph(form(dicom(GRAY)))
    assert (found.pixel_spacing_mm, found.spacing_source) == ((0.2, 0.18), SpacingSource.PIXEL_SPACING)


@pytest.mark.parametrize("content", [png(), dicom(GRAY, PixelSpacing=None)], ids=["PNG", "DICOM"])
def test_without_a_spacing_the_problem_says_what_to_do(form: Form, content: bytes) -> None:
    with pytest.raises(InvalidInputError, match="pixel_spacing_mm=") as error:
        read_new_radiograph(form(content))
    assert error.value.code == "pixel-spacing-missing"
    assert error.value.loc == ["body", "pixel_spacing_mm"]


@pytest.mark.parametrize(
    ("content", "code"), [(b"text", "invalid-image"), (dicom(GRAY, Rows=9), "invalid-dicom")]
)
def test_a_file_that_cannot_be_read_names_its_part(form: Form, content: bytes, code: str) -> None:
    with pytest.raises(InvalidInputError) as error:
        read_new_radiograph(form(content, pixel_spacing_mm="0.1,0.1"))
    assert (error.value.code, error.value.loc) == (code, ["body", "image"])


@pytest.mark.parametrize(
    "elements",
    [
        {"PatientOrientation": ["L", "F"]},
        {"PatientOrientation": ["R", "H"]},
        {"ViewPosition": "LL"},
    ],
    ids=["side", "head", "view"],
)
def test_a_file_that_contradicts_the_form_names_its_part(form: Form, elements: dict[str, Any]) -> None:
    read_new_radiograph(form(dicom(GRAY, PatientOrientation=["R", "F"], ViewPosition="PA")))
    with pytest.raises(InvalidInputError, match="the file says") as error:
        read_new_radiograph(form(dicom(GRAY, **elements)))
    assert (error.value.code, error.value.loc) == ("radiograph-view-contradicted", ["body", "image"])


def test_the_side_is_that_of_the_view(form: Form) -> None:
    lateral = {"view": "lateral", "left_on": None, "pixel_spacing_mm": "0.1,0.1"}
    new = read_new_radiograph(form(png(), **{**lateral, "anterior_on": "right"}))
    assert (new.view, new.positive_on) == ("lateral", "right")
    assert new.image.header.size == (4, 3)


@pytest.mark.parametrize(
    "fields",
    [
        {"left_on": None},
        {"anterior_on": "left"},
        {"view": "lateral"},
        {"view": "lateral", "left_on": None},
        {"view": "lateral", "anterior_on": "left"},
        {"view": "oblique"},
        {"left_on": "top"},
    ],
)
def test_a_missing_or_superfluous_side_is_refused(form: Form, fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        form(png(), **fields)


@pytest.mark.parametrize(
    "text",
    ["0.1", "0.1,0.1,0.1", "0,0.1", "-0.1,0.1", "a,b", "100,100", "1e-1,0.1", "nan,0.1", "0.1,0.3", ""],
)
def test_a_spacing_that_is_none_is_refused(form: Form, text: str) -> None:
    with pytest.raises(ValidationError):
        form(png(), pixel_spacing_mm=text)


def test_a_spacing_is_rows_and_columns() -> None:
    assert parse_spacing("0.2,0.143") == (0.2, 0.143)
    with pytest.raises(ValueError, match=r"0\.01 to 5"):
        parse_spacing("0.2,6")
