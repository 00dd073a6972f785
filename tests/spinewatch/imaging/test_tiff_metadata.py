from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.tiff_metadata import tiff_without_metadata as without_metadata

NAME = b"Anna Smith"
GRAY = np.random.default_rng(1).integers(0, 256, (41, 57), dtype=np.uint8)


def saved(pixels: Any, **options: Any) -> bytes:
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, "TIFF", **options)
    return buffer.getvalue()


def test_the_orientation_of_a_tiff_is_not_metadata() -> None:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[274], tags[270] = 6, NAME.decode()
    data = saved(GRAY, tiffinfo=tags)
    clean = without_metadata(data)
    assert NAME not in clean
    assert np.array_equal(decode_image(clean), decode_image(data))


def test_text_in_the_gaps_of_a_tiff_goes() -> None:
    data = saved(GRAY) + NAME
    clean = without_metadata(data)
    assert NAME not in clean
    assert np.array_equal(decode_image(clean), GRAY)


def test_strips_outside_a_tiff_are_refused() -> None:
    data = saved(GRAY, compression="raw")
    with pytest.raises(ImageError, match="damaged"):
        without_metadata(
            data[:8] + data[8:].replace((57 * 41).to_bytes(4, "little"), (1 << 30).to_bytes(4, "little"))
        )


def test_strips_of_the_same_bytes_are_refused() -> None:
    data = bytearray(saved(GRAY, compression="tiff_lzw", strip_size=100))
    start = int.from_bytes(data[4:8], "little")
    for k in range(int.from_bytes(data[start : start + 2], "little")):
        entry = start + 2 + 12 * k
        if int.from_bytes(data[entry : entry + 2], "little") == 279:
            count, place = (int.from_bytes(data[entry + n : entry + n + 4], "little") for n in (4, 8))
            width = 2 if data[entry + 2] == 3 else 4
            data[place : place + width * count] = (1000).to_bytes(width, "little") * count
    with pytest.raises(ImageError, match="damaged"):
        without_metadata(bytes(data))


def test_old_jpeg_in_a_tiff_is_refused() -> None:
    data = saved(GRAY, compression="raw")
    raw = bytes.fromhex("03010300010000000100")
    assert raw in data
    with pytest.raises(ImageError, match="export it again"):
        without_metadata(data.replace(raw, bytes.fromhex("03010300010000000600")))
