import time
from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, PngImagePlugin, TiffImagePlugin

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.header import inspect_image
from spinewatch.imaging.metadata import without_metadata
from tests.paths import SAMPLES

NAME = b"Anna Smith"
GRAY = np.random.default_rng(1).integers(0, 256, (41, 57), dtype=np.uint8)
DEEP = np.random.default_rng(2).integers(0, 65536, (41, 57), dtype=np.uint16)
COLOUR = np.random.default_rng(3).integers(0, 256, (41, 57, 3), dtype=np.uint8)


def saved(pixels: NDArray[Any], kind: str, **options: Any) -> bytes:
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, kind, **options)
    return buffer.getvalue()


def exif() -> bytes:
    tags = Image.Exif()
    tags[274], tags[315], tags[270] = 6, NAME.decode(), NAME.decode()
    return tags.tobytes()


def png(pixels: NDArray[Any], **options: Any) -> bytes:
    info = PngImagePlugin.PngInfo()
    info.add_text("Patient", NAME.decode())
    info.add_itxt("Patient", NAME.decode(), "de", "Patient")
    info.add_text("Long", NAME.decode() * 9, zip=True)
    info.add(b"prIv", NAME)
    info.add(b"tIME", bytes(7))
    return saved(pixels, "PNG", pnginfo=info, exif=exif(), icc_profile=NAME * 20, **options)


def jpeg(pixels: NDArray[Any], **options: Any) -> bytes:
    return saved(pixels, "JPEG", exif=exif(), comment=NAME, icc_profile=NAME * 20, xmp=NAME, **options) + NAME


def tiff(pixels: NDArray[Any], **options: Any) -> bytes:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[270], tags[315], tags[305], tags[65000] = (NAME.decode(),) * 4
    return saved(pixels, "TIFF", tiffinfo=tags, exif=exif(), **options)


def big_tiff(pixels: NDArray[Any], **options: Any) -> bytes:
    return tiff(pixels, big_tiff=True, **options)


CASES: list[tuple[Callable[..., bytes], NDArray[Any], dict[str, Any]]] = [
    (png, GRAY, {}), (png, DEEP, {}), (png, COLOUR, {}), (png, GRAY, {"transparency": 7}),
    (jpeg, GRAY, {}), (jpeg, COLOUR, {"progressive": True}), (jpeg, COLOUR, {"subsampling": 0}),
    (jpeg, GRAY, {"restart_marker_blocks": 2}),
    *((make, pixels, {"compression": c}) for make in (tiff, big_tiff) for pixels in (GRAY, DEEP, COLOUR)
      for c in ("raw", "tiff_lzw", "tiff_adobe_deflate", "packbits")),
    (tiff, GRAY, {"compression": "jpeg"}), (tiff, COLOUR, {"compression": "jpeg"}),
    *((tiff, GRAY, {"compression": c, "strip_size": 100}) for c in ("raw", "tiff_lzw")),
]  # fmt: skip


@pytest.mark.parametrize(("make", "pixels", "options"), CASES)
def test_metadata_go_and_pixels_stay(
    make: Callable[..., bytes], pixels: NDArray[Any], options: dict[str, Any]
) -> None:
    data = make(pixels, **options)
    assert b"Anna" in data
    clean = without_metadata(data)
    for trace in (b"Anna", b"Smith", b"Exif", b"iCCP", b"Patient", b"prIv"):
        assert trace not in clean
    assert decode_image(clean).dtype == decode_image(data).dtype
    assert np.array_equal(decode_image(clean), decode_image(data))
    assert inspect_image(clean) == inspect_image(data)
    assert without_metadata(clean) == clean
    with Image.open(BytesIO(clean)) as image:
        assert not {"comment", "exif", "icc_profile", "xmp", "Patient"} & set(image.info)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
@pytest.mark.parametrize("pixels", [GRAY, COLOUR])
def test_a_file_without_metadata_stays_as_it_is(kind: str, pixels: NDArray[Any]) -> None:
    data = saved(pixels, kind)
    assert without_metadata(data) == data


def sun(pixels: NDArray[Any], after: bytes) -> bytes:
    height, width = pixels.shape
    rows = np.zeros((height, width + width % 2), np.uint8)
    rows[:, :width] = pixels
    header = np.array([0x59A66A95, width, height, 8, rows.size, 1, 0, 0], ">u4")
    return header.tobytes() + rows.tobytes() + after


def test_what_follows_a_sun_raster_goes() -> None:
    clean = without_metadata(sun(GRAY, NAME))
    assert clean == sun(GRAY, b"")
    assert np.array_equal(decode_image(clean), GRAY)


def test_a_thumbnail_of_a_jpeg_goes() -> None:
    data = saved(GRAY, "JPEG")
    thumbnail = data[:2] + b"\xff\xe0\x00\x13JFIF\0\x01\x01\0\0\1\0\1\1\1abc" + data[20:]
    assert np.array_equal(decode_image(thumbnail), decode_image(data))
    assert without_metadata(thumbnail) == data


@pytest.mark.parametrize("size", [60, 200, 1000])
@pytest.mark.parametrize("make", [png, jpeg, tiff])
def test_a_truncated_file_does_not_become_whole(make: Callable[..., bytes], size: int) -> None:
    data = make(GRAY)[:-size]
    try:
        inspect_image(data)
        clean = without_metadata(data)
    except ImageError:
        return
    with pytest.raises(ImageError):
        decode_image(clean)


def test_a_pair_costs_a_fraction_of_its_decoding() -> None:
    pair = [(SAMPLES / "D1" / "PRE" / f"{side}.png").read_bytes() for side in ("left", "right")]
    assert _seconds(without_metadata, pair) < 0.2 * _seconds(decode_image, pair)


def _seconds(action: Callable[[bytes], Any], pair: list[bytes]) -> float:
    """The least CPU time for a pair."""
    times = []
    for _ in range(10):
        start = time.process_time()
        for data in pair:
            action(data)
        times.append(time.process_time() - start)
    return min(times)
