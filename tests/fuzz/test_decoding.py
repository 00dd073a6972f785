"""Files with any content: each is an image, or an ``ImageError``, and nothing else."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.header import MAX_PIXELS, inspect_image
from spinewatch.imaging.radiograph_image import read_radiograph
from tests.fuzz.byte_mutations import mutate
from tests.fuzz.campaign import outcome_of, run

_SIZE = (20, 12)


def small_files() -> list[bytes]:
    """Return a small file of every format, mode and compression that the readers know."""
    rng = np.random.default_rng(0)
    gray = Image.fromarray(rng.integers(0, 256, _SIZE[::-1], np.uint8))
    deep = Image.fromarray(rng.integers(0, 65536, _SIZE[::-1], np.uint16))
    colour = Image.merge("RGB", [gray, gray, gray])
    files = [_saved(image, "PNG") for image in (gray, deep, colour, gray.convert("1"), gray.convert("P"))]
    files += [_saved(gray, "JPEG"), _saved(colour, "JPEG", progressive=True)]
    files += [
        _saved(gray, "TIFF", compression=name) for name in (None, "tiff_lzw", "tiff_deflate", "packbits")
    ]
    files += [_saved(deep, "TIFF"), _saved(colour, "TIFF"), _saved(gray, "TIFF", tiffinfo={274: 6})]
    return [*files, sun_raster(gray)]


def sun_raster(image: Image.Image) -> bytes:
    header = (0x59A66A95, image.width, image.height, 8, image.width * image.height, 1, 0, 0)
    return b"".join(value.to_bytes(4, "big") for value in header) + image.tobytes()


def _saved(image: Image.Image, kind: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def header_outcome(data: bytes) -> str:
    try:
        header = inspect_image(data)
    except ImageError as error:
        return f"header {outcome_of(error)}"
    assert header.width > 0
    assert header.height > 0
    assert header.width * header.height <= MAX_PIXELS
    return f"header {header.kind}"


def pixel_outcome(data: bytes) -> str:
    try:
        pixels = decode_image(data)
    except ImageError as error:
        return f"pixels {outcome_of(error)}"
    assert pixels.dtype in (np.uint8, np.uint16)
    assert pixels.shape[::-1] == inspect_image(data).size
    return f"pixels {pixels.dtype}"


def radiograph_outcome(data: bytes) -> str:
    try:
        found = read_radiograph(data)
    except ImageError as error:
        return f"radiograph {outcome_of(error)}"
    assert decode_image(found.png).shape == (found.height, found.width)
    return f"radiograph {found.spacing_source}"


@pytest.mark.timeout(1200)
def test_a_file_of_any_content_is_an_image_or_an_error() -> None:
    run("images", small_files(), mutate, lambda data: f"{header_outcome(data)}; {pixel_outcome(data)}")


@pytest.mark.timeout(1200)
def test_a_radiograph_of_any_content_is_an_image_or_an_error() -> None:
    run("radiographs", small_files(), mutate, radiograph_outcome)
