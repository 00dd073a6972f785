import pytest

from spinewatch.errors import ImageError
from spinewatch.imaging.jpeg_segments import jpeg_size
from tests.image_bombs import SIZE, encoded, jpeg, segment


def test_the_size_is_that_of_the_frame() -> None:
    assert jpeg_size(jpeg()) == SIZE
    assert jpeg_size(encoded("JPEG", size=(7, 5), progressive=True)) == (7, 5)


def test_metadata_and_filling_before_the_frame_are_read_over() -> None:
    assert (
        jpeg_size(jpeg(segment(0xE1, b"Exif\0\0" + bytes(60_000)), b"\xff\xff", segment(0xFE, b"x"))) == SIZE
    )


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (jpeg(segment(0xE0, b"") * 300), "too many"),
        (jpeg(segment(0xE2, bytes(65_000)) * 20), "too long"),
        (jpeg() + b"\xff\xda" * 200, "too many"),
        (jpeg(b"\xff\x00"), "damaged"),
        (jpeg(segment(0xF0, b"")), "damaged"),
        (jpeg(b"garbage"), "damaged"),
        (jpeg()[:100], "damaged"),
        (b"\xff\xd8" + segment(0xDA, bytes(6)), "damaged"),
    ],
)
def test_what_no_camera_writes_is_refused(data: bytes, word: str) -> None:
    with pytest.raises(ImageError, match=word):
        jpeg_size(data)
