"""A radiograph is decoded apart: the same result, and an end by name for what takes too much."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from tempfile import SpooledTemporaryFile

import numpy as np
import pytest
from PIL import Image

from service.limited_process import ProcessLimits
from service.radiograph_process import RADIOGRAPH_LIMITS, RadiographTooCostlyError, read_apart
from spinewatch.errors import ImageError
from spinewatch.imaging.radiograph_image import RadiographImage, read_radiograph
from tests.spinewatch.imaging.dicom_files import dicom

GRAY = np.arange(60, dtype=np.uint16).reshape(6, 10) * 999


def png(pixels: np.ndarray) -> bytes:
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()


def noise() -> bytes:
    """Return a file of 25 million pixels that takes seconds to compress again."""
    return dicom(np.random.default_rng(1).integers(0, 256, (5000, 5000), dtype=np.uint8))


def read(content: bytes, limits: ProcessLimits = RADIOGRAPH_LIMITS) -> RadiographImage:
    with SpooledTemporaryFile(max_size=1 << 20) as file:
        file.write(content)
        return read_apart(file, limits)


@pytest.mark.parametrize("content", [png(GRAY), dicom(GRAY), dicom(GRAY, PixelSpacing=None)])
def test_the_result_is_that_of_decoding_here(content: bytes) -> None:
    assert vars(read(content)) == vars(read_radiograph(content))


@pytest.mark.parametrize("content", [b"", b"text", png(GRAY)[:50], dicom(GRAY, Rows=99), dicom(GRAY)[:200]])
def test_an_error_keeps_its_code_and_sentence(content: bytes) -> None:
    with pytest.raises(ImageError) as here:
        read_radiograph(content)
    with pytest.raises(ImageError) as apart:
        read(content)
    assert (apart.value.code, str(apart.value)) == (here.value.code, str(here.value))


@pytest.mark.parametrize(
    ("content", "limits"),
    [
        (noise(), replace(RADIOGRAPH_LIMITS, cpu_seconds=1)),
        (png(np.full((5600, 5600, 4), 7, np.uint8)), replace(RADIOGRAPH_LIMITS, memory_bytes=300 << 20)),
    ],
    ids=["CPU time", "memory"],
)
def test_what_takes_too_much_is_named(content: bytes, limits: ProcessLimits) -> None:
    with pytest.raises(RadiographTooCostlyError, match="smaller") as error:
        read(content, limits)
    assert error.value.code == "radiograph-too-costly"
