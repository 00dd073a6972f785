from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from spinewatch.imaging.lzw import lzw_expands_to


def packed(content: bytes) -> bytes:
    """Return what libtiff writes for some bytes."""
    buffer = BytesIO()
    Image.frombytes("L", (len(content), 1), content).save(buffer, "TIFF", compression="tiff_lzw")
    with Image.open(buffer) as image:
        (place,), (size,) = image.tag_v2[273], image.tag_v2[279]  # type: ignore[attr-defined]
    return buffer.getvalue()[place : place + size]


def codes(*pairs: tuple[int, int]) -> bytes:
    """Return codes, each with its number of bits."""
    bits = "".join(f"{code:0{width}b}" for code, width in pairs)
    return int(bits.ljust(-(-len(bits) // 8) * 8, "0"), 2).to_bytes(-(-len(bits) // 8), "big")


@given(st.integers(1, 6_000), st.integers(1, 256), st.integers(0, 2**32 - 1))
def test_what_an_encoder_writes_has_the_size_of_its_content(size: int, levels: int, seed: int) -> None:
    content = np.random.default_rng(seed).integers(0, levels, size, np.uint8).tobytes()
    data = packed(content)
    assert lzw_expands_to(size, data)
    assert not lzw_expands_to(size - 1, data)
    assert not lzw_expands_to(size + 1, data)


def test_long_strings_have_their_size() -> None:
    assert lzw_expands_to(3_000_000, packed(bytes(3_000_000)))


@pytest.mark.parametrize("bit", range(8))
def test_flipped_bits_are_found_or_keep_the_size(bit: int) -> None:
    rng = np.random.default_rng(5)
    content = np.clip(90 + 4 * rng.standard_normal(8_000), 0, 255).astype(np.uint8).tobytes()
    data, found = packed(content), 0
    for position in range(100, len(data) - 100, len(data) // 40):
        damaged = bytearray(data)
        damaged[position] ^= 1 << bit
        found += not lzw_expands_to(len(content), bytes(damaged))
    assert found >= 10


@pytest.mark.parametrize(
    "data",
    [
        b"",
        codes((1, 9), (2, 9), (3, 9), (257, 9)),
        codes((256, 9), (1, 9), (2, 9), (3, 9)),
        codes((256, 9), (1, 9), (300, 9), (3, 9), (257, 9)),
        codes((256, 9), (258, 9), (1, 9), (257, 9)),
        codes((256, 9), (1, 9), (256, 9), (2, 9), (256, 9), (3, 9), (257, 9)),
    ],
    ids=[
        "empty",
        "no clear code",
        "no end code",
        "code not defined",
        "first code not defined",
        "cleared too often",
    ],
)
def test_data_that_no_encoder_writes_are_found(data: bytes) -> None:
    assert not lzw_expands_to(3, data)


def test_a_string_that_is_defined_twice_is_found() -> None:
    once = codes((256, 9), (1, 9), (2, 9), (258, 9), (257, 9))
    twice = codes((256, 9), (1, 9), (2, 9), (1, 9), (2, 9), (257, 9))
    assert lzw_expands_to(4, once)
    assert not lzw_expands_to(4, twice)
