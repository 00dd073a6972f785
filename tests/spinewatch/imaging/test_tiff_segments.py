"""Compressed TIFFs of every layout are read, and refused with one flipped bit."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.tiff_segments import require_whole_segments
from tests.paths import SAMPLES
from tests.tiff_files import tiff

STRIPS, STRIP_BYTES = 273, 279


@cache
def sample() -> np.ndarray[Any, Any]:
    return decode_image((SAMPLES / "D1" / "PRE" / "left.png").read_bytes())[100:260, 100:300]


@cache
def saved(compression: str, **options: Any) -> bytes:
    buffer = BytesIO()
    Image.fromarray(sample()).save(buffer, "TIFF", compression=compression, **options)
    return buffer.getvalue()


def tags(data: bytes) -> TiffImagePlugin.ImageFileDirectory_v2:
    with Image.open(BytesIO(data)) as image:
        assert isinstance(image, TiffImagePlugin.TiffImageFile)
        return image.tag_v2


def flipped(data: bytes, seed: int) -> bytes:
    """Return a file with one flipped bit in a strip, not in its last two bytes, which may be padding."""
    rng, directory = np.random.default_rng(seed), tags(data)
    strip = rng.integers(len(directory[STRIPS]))
    damaged = bytearray(data)
    damaged[directory[STRIPS][strip] + rng.integers(directory[STRIP_BYTES][strip] - 2)] ^= 1 << rng.integers(
        8
    )
    return bytes(damaged)


@pytest.mark.parametrize("seed", range(20))
def test_every_flipped_bit_in_deflate_is_refused(seed: int) -> None:
    with pytest.raises(ImageError, match=r"damaged or incomplete .*copy it again"):
        decode_image(flipped(saved("tiff_adobe_deflate"), seed))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("compression", ["tiff_lzw", "packbits"])
def test_a_flipped_bit_in_other_compressions_is_refused_or_displaces_nothing(
    compression: str, seed: int
) -> None:
    try:
        image = decode_image(flipped(saved(compression), seed))
    except ImageError:
        return
    assert np.count_nonzero(image != sample()) <= 128


def test_a_jpeg_strip_that_lost_bytes_is_refused() -> None:
    data = saved("jpeg")
    directory = tags(data)
    place, size = directory[STRIPS][0], directory[STRIP_BYTES][0]
    middle, end = place + size // 2, place + size
    with pytest.raises(ImageError, match="damaged or incomplete"):
        decode_image(data[:middle] + data[middle + 60 : end] + bytes(60) + data[end:])


LAYOUTS: dict[str, dict[str, Any]] = {
    "strips": {},
    "tiles": {"tile": (64, 48)},
    "predictor": {"predictor": 2},
    "BigTIFF": {"is_big": True},
    "bits in reverse order": {"fill_order": 2},
    "most significant byte first": {"order": ">"},
    "planes one after the other": {"planar": 2},
}


@pytest.mark.parametrize("options", LAYOUTS.values(), ids=LAYOUTS.keys())
@pytest.mark.parametrize("compression", [5, 8, 32946, 32773])
@pytest.mark.parametrize("bits", [8, 16])
def test_sound_files_of_every_layout_are_whole(options: dict[str, Any], compression: int, bits: int) -> None:
    image = sample()[:100, :133].astype(np.uint16) << (bits - 8)
    if options.get("planar"):
        image = np.stack([image] * 3, axis=-1)
    data = tiff(image, bits, compression=compression, **options)
    require_whole_segments(data, tags(data))


@pytest.mark.parametrize("options", LAYOUTS.values(), ids=LAYOUTS.keys())
def test_a_flipped_bit_is_found_in_every_layout(options: dict[str, Any]) -> None:
    image = sample()[:100, :133]
    if options.get("planar"):
        image = np.stack([image] * 3, axis=-1)
    data = bytearray(tiff(image, 8, compression=8, **options))
    directory = tags(bytes(data))
    places = directory.get(324) or directory[STRIPS]
    data[places[-1] + 8] ^= 4
    with pytest.raises(ImageError, match="damaged or incomplete"):
        require_whole_segments(bytes(data), directory)


@pytest.mark.parametrize(
    "change",
    [
        lambda tags: tags | {STRIPS: tags[STRIPS][:-1]},
        lambda tags: tags | {STRIP_BYTES: tags[STRIP_BYTES][:-1]},
        lambda tags: tags | {STRIP_BYTES: (*tags[STRIP_BYTES][:-1], 10**8)},
        lambda tags: tags | {STRIPS: (tags[STRIPS][1], *tags[STRIPS][1:])},
        lambda tags: tags | {257: tags[257] + 1},
        lambda tags: tags | {322: 60_000, 323: 60_000, 324: (8,), 325: (9,)},
    ],
    ids=[
        "a strip too few",
        "a size too few",
        "beyond the end",
        "the place of another",
        "a row more",
        "a huge tile",
    ],
)
def test_strips_that_are_not_those_of_the_image_are_refused(
    change: Callable[[dict[int, Any]], dict[int, Any]],
) -> None:
    image = np.vstack([sample()[:64], sample()[:40] // 2])
    data = tiff(image, 8, compression=8)
    with pytest.raises(ImageError, match="damaged or incomplete"):
        require_whole_segments(data, change(dict(tags(data))))


@pytest.mark.parametrize(
    ("compression", "name"), [("group4", "CCITT Group 4"), ("lzma", "LZMA"), ("zstd", "Zstandard")]
)
def test_compressions_without_a_check_are_refused_by_name(compression: str, name: str) -> None:
    buffer, gray = BytesIO(), Image.fromarray(sample())
    (gray.convert("1") if compression == "group4" else gray).save(buffer, "TIFF", compression=compression)
    with pytest.raises(ImageError, match=f"compression {name}, in which damage cannot be found"):
        decode_image(buffer.getvalue())


def test_compressed_ycbcr_is_refused_by_name() -> None:
    data = tiff(np.stack([sample()] * 3, axis=-1), 8, compression=8, photometric=6)
    with pytest.raises(ImageError, match="compressed YCbCr"):
        require_whole_segments(data, tags(data))


def test_a_jpeg_strip_of_another_size_is_refused() -> None:
    data = saved("jpeg")
    with pytest.raises(ImageError, match="damaged or incomplete"):
        require_whole_segments(data, dict(tags(data)) | {256: sample().shape[1] - 8})
