import pytest

from spinewatch.imaging.packbits import packbits_expand_to

PACKED = bytes([253, 9, 0, 7, 128, 2, 1, 2, 3, 255, 4])
"""Two rows of five bytes: 9 four times and 7; then nothing; 1, 2, 3 and twice 4."""


def test_rows_that_are_packed_each_by_itself_are_whole() -> None:
    assert packbits_expand_to(5, 2, PACKED)


@pytest.mark.parametrize("position", [0, 2, 5, 9])
@pytest.mark.parametrize("bit", range(8))
def test_every_flipped_bit_of_a_length_is_found(position: int, bit: int) -> None:
    damaged = bytearray(PACKED)
    damaged[position] ^= 1 << bit
    assert not packbits_expand_to(5, 2, bytes(damaged))


@pytest.mark.parametrize("data", [PACKED[:-1], PACKED[:-2], PACKED + b"\0\1", b""])
def test_missing_and_surplus_bytes_are_found(data: bytes) -> None:
    assert not packbits_expand_to(5, 2, data)
