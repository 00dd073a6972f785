import pytest

from spinewatch.errors import ImageError
from spinewatch.imaging.png_chunks import png_size
from tests.image_bombs import SIZE, chunk, encoded, pixels, png


def test_the_size_is_that_of_the_header() -> None:
    assert png_size(encoded("PNG")) == SIZE
    assert png_size(png(pixels(), chunk(b"IEND"), size=(7, 5))) == (7, 5)


@pytest.mark.parametrize("count", [1, 8000])
def test_as_many_chunks_as_encoders_write_are_read(count: int) -> None:
    assert png_size(png(chunk(b"IDAT", b"x") * count, chunk(b"IEND"))) == SIZE


def test_zeros_after_the_image_are_filling() -> None:
    assert png_size(encoded("PNG") + bytes(100)) == SIZE
    with pytest.raises(ImageError, match="further data"):
        png_size(encoded("PNG") + b"more")


def test_a_truncated_image_is_left_to_the_decoder() -> None:
    whole = encoded("PNG")
    for length in (len(whole) - 12, len(whole) - 20, len(whole) // 2):
        assert png_size(whole[:length]) == SIZE


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (png(chunk(b"IDAT") * 9000, chunk(b"IEND")), "too many"),
        (png(chunk(b"tEXt", b"a\0b") * 300, pixels()), "too many"),
        (png(chunk(b"iCCP", b"a\0\0") * 17, pixels()), "too many"),
        (png(chunk(b"tEXt", bytes(1_100_000)), pixels()), "too long"),
        (png(chunk(b"acTL", bytes(8)), pixels()), "several"),
        (png(chunk(b"IHDR", bytes(13)), pixels()), "damaged"),
        (png(), "damaged"),
        (encoded("PNG")[:8], "damaged"),
        (encoded("PNG")[:8] + chunk(b"IDAT", b"x"), "damaged"),
    ],
)
def test_what_no_camera_writes_is_refused(data: bytes, word: str) -> None:
    with pytest.raises(ImageError, match=word):
        png_size(data)
