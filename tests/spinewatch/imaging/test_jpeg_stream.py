"""Damage that libjpeg only warns about is found, and sound files of all kinds are not refused."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.jpeg_stream import is_stream_complete
from tests.paths import SAMPLES

KINDS: dict[str, dict[str, Any]] = {
    "usual": {},
    "optimized": {"optimize": True},
    "progressive": {"progressive": True},
    "restart markers": {"restart_marker_blocks": 50},
}


def encoded(image: Image.Image, **options: Any) -> bytes:
    buffer = BytesIO()
    image.save(buffer, "JPEG", **options)
    return buffer.getvalue()


def sample() -> Image.Image:
    return Image.open(SAMPLES / "D1" / "PRE" / "left.png")


@pytest.mark.parametrize("options", KINDS.values(), ids=KINDS.keys())
@pytest.mark.parametrize("quality", [20, 75, 92])
@pytest.mark.parametrize("mode", ["L", "RGB"])
def test_sound_files_are_complete(options: dict[str, Any], quality: int, mode: str) -> None:
    assert is_stream_complete(encoded(sample().convert(mode), quality=quality, **options))


@given(st.integers(1, 70), st.integers(1, 70), st.integers(0, 255), st.integers(0, 40), st.integers(5, 98))
def test_small_flat_and_saturated_images_are_complete(
    width: int, height: int, level: int, noise: int, quality: int
) -> None:
    rng = np.random.default_rng(width * height + level)
    levels = np.clip(level + noise * rng.standard_normal((height, width)), 0, 255).astype(np.uint8)
    assert is_stream_complete(encoded(Image.fromarray(levels), quality=quality))


@pytest.mark.parametrize("kind", ["usual", "optimized", "restart markers"])
def test_missing_bytes_are_found(kind: str) -> None:
    data = encoded(sample(), quality=92, **KINDS[kind])
    middle = len(data) // 2
    assert not is_stream_complete(data[:middle] + data[middle + 300 :])


def test_surplus_bytes_are_found() -> None:
    data = encoded(sample(), quality=92)
    middle = len(data) // 2
    assert not is_stream_complete(data[:middle] + data[middle - 300 :])


def test_file_without_a_scan_is_incomplete() -> None:
    assert not is_stream_complete(encoded(sample())[:200])


def test_decoding_refuses_a_damaged_file() -> None:
    data = encoded(sample(), quality=92)
    middle = len(data) // 2
    with pytest.raises(ImageError, match="do not end where the image ends"):
        decode_image(data[:middle] + data[middle + 300 :])
