"""Radiographs without the metadata of their files."""

import io

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from spinewatch.errors import ImageError
from spinewatch.imaging.dicom import MAX_RADIOGRAPH_PIXELS
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.imaging.radiograph_image import BlankRadiographError, read_radiograph
from spinewatch.imaging.stated_view import StatedView
from tests.spinewatch.imaging.dicom_files import PATIENT, dicom

GRAY = (np.add.outer(np.arange(40), np.arange(30)) * 3).astype(np.uint8)
NAME = b"Erika Mustermann"


def saved(image: Image.Image, kind: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def exif(orientation: int = 1) -> Image.Exif:
    tags = Image.Exif()
    tags[315] = NAME.decode()
    tags[274] = orientation
    return tags


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)))


def chunks(png: bytes) -> list[bytes]:
    """Return the types of the chunks of a PNG."""
    found, at = [], 8
    while at < len(png):
        length = int.from_bytes(png[at : at + 4], "big")
        found.append(png[at + 4 : at + 8])
        at += 12 + length
    return found


def described() -> PngImagePlugin.PngInfo:
    info = PngImagePlugin.PngInfo()
    info.add_text("Patient", NAME.decode())
    return info


@pytest.mark.parametrize(
    "content",
    [
        saved(Image.fromarray(GRAY), "PNG", pnginfo=described(), exif=exif(), dpi=(300, 300)),
        saved(Image.fromarray(GRAY), "TIFF", tiffinfo={270: NAME.decode()}),
        saved(Image.fromarray(GRAY), "JPEG", quality=100, exif=exif(), comment=NAME),
        saved(Image.fromarray(GRAY).convert("RGB"), "PNG", pnginfo=described()),
        saved(Image.fromarray(GRAY).convert("P"), "PNG", pnginfo=described()),
    ],
    ids=["PNG", "TIFF", "JPEG", "colour", "palette"],
)
def test_of_an_image_only_gray_levels_are_kept(content: bytes) -> None:
    assert NAME in content
    found = read_radiograph(content)
    assert NAME not in found.png
    assert set(chunks(found.png)) == {b"IHDR", b"IDAT", b"IEND"}
    assert np.abs(pixels(found.png).astype(int) - GRAY).max() <= 2
    assert (found.width, found.height) == (30, 40)
    assert (found.pixel_spacing_mm, found.spacing_source) == (None, None)


@pytest.mark.parametrize("kind", ["PNG", "TIFF"])
def test_16_bits_are_kept(kind: str) -> None:
    deep = GRAY.astype(np.uint16) * 257
    np.testing.assert_array_equal(pixels(read_radiograph(saved(Image.fromarray(deep), kind)).png), deep)


def test_a_tiff_with_white_as_zero_is_inverted() -> None:
    deep = GRAY.astype(np.uint16) * 257
    content = saved(Image.fromarray(deep), "TIFF", tiffinfo={262: 0})
    np.testing.assert_array_equal(pixels(read_radiograph(content).png), 65535 - deep)


def test_of_a_dicom_file_only_gray_levels_and_spacing_are_kept() -> None:
    content = dicom(GRAY)
    assert PATIENT.encode() in content
    found = read_radiograph(content)
    assert set(chunks(found.png)) == {b"IHDR", b"IDAT", b"IEND"}
    assert (found.pixel_spacing_mm, found.spacing_source) == ((0.2, 0.18), SpacingSource.PIXEL_SPACING)


def test_the_source_of_the_spacing_is_told() -> None:
    at_detector = read_radiograph(dicom(GRAY, PixelSpacing=None, ImagerPixelSpacing=["0.1", "0.1"]))
    assert at_detector.spacing_source is SpacingSource.IMAGER_PIXEL_SPACING
    not_calibrated = read_radiograph(dicom(GRAY, ImagerPixelSpacing=["0.2", "0.18"]))
    assert not_calibrated.pixel_spacing_mm == (0.2, 0.18)
    assert not_calibrated.spacing_source is SpacingSource.IMAGER_PIXEL_SPACING
    calibrated = read_radiograph(dicom(GRAY, ImagerPixelSpacing=["0.22", "0.2"]))
    assert calibrated.pixel_spacing_mm == (0.2, 0.18)
    assert calibrated.spacing_source is SpacingSource.PIXEL_SPACING
    nowhere = read_radiograph(dicom(GRAY, PixelSpacing=None))
    assert (nowhere.pixel_spacing_mm, nowhere.spacing_source) == (None, None)


def test_the_same_pixels_give_the_same_file() -> None:
    one = saved(Image.fromarray(GRAY), "PNG", pnginfo=described())
    two = saved(Image.fromarray(GRAY), "TIFF")
    assert read_radiograph(one).png == read_radiograph(two).png


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
@pytest.mark.parametrize("orientation", [3, 6])
def test_an_orientation_tag_is_refused(kind: str, orientation: int) -> None:
    content = saved(Image.fromarray(GRAY), kind, exif=exif(orientation))
    with pytest.raises(ImageError, match="orientation tag"):
        read_radiograph(content)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
def test_a_blank_image_is_refused(kind: str) -> None:
    with pytest.raises(BlankRadiographError, match="blank"):
        read_radiograph(saved(Image.new("L", (30, 20), 9), kind))


def test_a_blank_dicom_file_is_refused() -> None:
    with pytest.raises(BlankRadiographError, match="blank"):
        read_radiograph(dicom(np.full((4, 5), 700, np.uint16)))


def test_a_png_without_its_end_is_refused() -> None:
    whole = saved(Image.fromarray(GRAY), "PNG")
    for missing in (1, 12, 21):
        with pytest.raises(ImageError, match="incomplete"):
            read_radiograph(whole[:-missing])


def test_what_a_dicom_file_says_of_its_view_is_kept() -> None:
    found = read_radiograph(dicom(GRAY, ViewPosition="LL", PatientOrientation=["A", "F"]))
    assert found.stated_view == StatedView("LL", "A", "F")
    assert read_radiograph(saved(Image.fromarray(GRAY), "PNG")).stated_view == StatedView()


def test_too_many_pixels_are_refused_before_decoding() -> None:
    content = saved(Image.new("1", (8000, MAX_RADIOGRAPH_PIXELS // 8000 + 1)), "PNG")
    assert len(content) < 100_000
    with pytest.raises(ImageError, match="32 million"):
        read_radiograph(content)


@pytest.mark.parametrize(
    "content",
    [b"", b"text", saved(Image.fromarray(GRAY), "PNG")[:-60], saved(Image.fromarray(GRAY), "JPEG")[:400]],
)
def test_what_is_no_image_or_damaged_is_refused(content: bytes) -> None:
    with pytest.raises(ImageError):
        read_radiograph(content)


DAMAGED = np.clip(np.random.default_rng(4).normal(90, 20, (90, 120)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("JPEG", {"quality": 90}),
        ("PNG", {}),
        ("TIFF", {"compression": "tiff_lzw"}),
        ("TIFF", {"compression": "tiff_adobe_deflate"}),
        ("TIFF", {"compression": "jpeg"}),
    ],
    ids=["JPEG", "PNG", "LZW", "Deflate", "JPEG in TIFF"],
)
@pytest.mark.parametrize("share", [0.5, 0.7])
def test_a_file_with_forty_wrong_bytes_is_refused(
    kind: str, options: dict[str, object], share: float
) -> None:
    data = saved(Image.fromarray(DAMAGED), kind, **options)
    place = int(len(data) * share)
    with pytest.raises(ImageError, match="damaged or incomplete"):
        read_radiograph(data[:place] + bytes(40) + data[place + 40 :])


@pytest.mark.parametrize("bit", range(8))
@pytest.mark.parametrize("share", [0.2, 0.4, 0.6, 0.8])
def test_a_flipped_bit_in_a_tiff_with_deflate_is_refused(share: float, bit: int) -> None:
    data = bytearray(saved(Image.fromarray(DAMAGED), "TIFF", compression="tiff_adobe_deflate"))
    data[int(len(data) * share)] ^= 1 << bit
    with pytest.raises(ImageError, match="damaged or incomplete"):
        read_radiograph(bytes(data))
