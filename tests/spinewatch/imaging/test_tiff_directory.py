import struct

import pytest

from spinewatch.errors import ImageError
from spinewatch.imaging.tiff_directory import tiff_size
from tests.image_bombs import SIZE, Entry, encoded, tiff, value


@pytest.mark.parametrize("data", [tiff(), encoded("TIFF"), encoded("TIFF", big_tiff=True)])
def test_the_size_is_that_of_the_directory(data: bytes) -> None:
    assert tiff_size(data) == SIZE


def test_the_order_of_bytes_may_be_either() -> None:
    entries = [(256, 3, 1, 7 << 16), (257, 4, 1, 5)]
    directory = b"".join(struct.pack(">HHII", *entry) for entry in entries)
    data = b"MM\0*" + struct.pack(">IH", 8, len(entries)) + directory + bytes(4)
    assert tiff_size(data) == (7, 5)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({273: (4, 20_000, value(8))}, "too many"),
        ({274: (2, 4, b"abc\0")}, "wrong type"),
        ({274: (3, 0, value(0))}, "wrong type"),
        ({258: (5, 1, value(8))}, "wrong type"),
        ({339: (11, 1, value(8))}, "wrong type"),
        ({282: (5, 2000, value(8))}, "too many"),
        ({301: (3, 0xFFFFFFFF, value(8))}, "damaged"),
        ({257: (3, 1, value(0))}, "damaged"),
        ({262: (3, 1, value(8))}, r"colour L\*a\*b\*, which is not supported"),
        ({262: (3, 1, value(32844))}, "colour of kind 32844"),
        ({322: (4, 1, value(100_000)), 323: (4, 1, value(100_000))}, "too many"),
    ],
)
def test_what_no_camera_writes_is_refused(changes: dict[int, Entry], word: str) -> None:
    with pytest.raises(ImageError, match=word):
        tiff_size(tiff(changes))


def test_numbers_and_bytes_are_limited_in_all() -> None:
    rest = bytes(300_000)
    for kind, each in ((3, 90_000), (1, 300_000)):
        entries = {50_000 + n: (kind, each, value(8)) for n in range(4)}
        with pytest.raises(ImageError, match="too many"):
            tiff_size(tiff(entries, rest))


def test_several_images_are_refused() -> None:
    with pytest.raises(ImageError, match="several"):
        tiff_size(tiff(next_directory=8))


@pytest.mark.parametrize("length", [4, 8, 9, 40])
def test_a_truncated_directory_is_refused(length: int) -> None:
    data = b"II*\0" + value(8) + struct.pack("<H", 9) + bytes(108)
    with pytest.raises(ImageError):
        tiff_size(data[:length])
