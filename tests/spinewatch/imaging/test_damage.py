"""Damaged files of every format are refused with a request to copy them again."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.damage import require_undamaged
from spinewatch.imaging.header import open_image
from tests.spinewatch.imaging.test_sun_raster import GRAY, raster

NOISE = Image.fromarray(np.random.default_rng(2).integers(0, 256, (90, 120), dtype=np.uint8))


def saved(kind: str, **options: Any) -> bytes:
    buffer = BytesIO()
    NOISE.save(buffer, kind, **options)
    return buffer.getvalue()


FILES = {
    "PNG": saved("PNG"),
    "JPEG": saved("JPEG", quality=90),
    "TIFF": saved("TIFF"),
    "TIFF with LZW": saved("TIFF", compression="tiff_lzw"),
    "TIFF with Deflate": saved("TIFF", compression="tiff_adobe_deflate"),
    "Sun raster": raster(GRAY, GRAY.shape[1]),
}


def check(data: bytes) -> None:
    with open_image(data) as image:
        require_undamaged(data, image)


@pytest.mark.parametrize("data", FILES.values(), ids=FILES.keys())
def test_sound_files_are_taken(data: bytes) -> None:
    check(data)


@pytest.mark.parametrize("kind", sorted(FILES.keys() - {"TIFF"}))
def test_what_lost_bytes_in_the_middle_is_refused(kind: str) -> None:
    data = FILES[kind]
    middle = len(data) // 2
    with pytest.raises(
        ImageError, match=r"damaged or incomplete .*copy it again|damaged or incomplete; copy it again"
    ):
        check(data[:middle] + data[middle + 30 :])
