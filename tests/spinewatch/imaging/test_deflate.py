import zlib

import pytest

from spinewatch.imaging.deflate import inflates_to

CONTENT = bytes(range(256)) * 3000
PACKED = zlib.compress(CONTENT)


def test_sound_data_have_their_size_in_one_part_or_several() -> None:
    assert inflates_to(len(CONTENT), [PACKED])
    assert inflates_to(len(CONTENT), [PACKED[:7], PACKED[7:300], PACKED[300:]])


@pytest.mark.parametrize(
    ("size", "data"),
    [
        (len(CONTENT) - 1, PACKED),
        (len(CONTENT) + 1, PACKED),
        (len(CONTENT), PACKED[:-1]),
        (len(CONTENT), PACKED + b"\0"),
        (len(CONTENT), PACKED[:-1] + bytes([PACKED[-1] ^ 1])),
        (len(CONTENT), b"no Deflate"),
    ],
    ids=["too long", "too short", "cut", "surplus", "wrong checksum", "something else"],
)
def test_other_data_are_found(size: int, data: bytes) -> None:
    assert not inflates_to(size, [data])
