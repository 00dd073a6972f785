"""Pixels and spacing of DICOM files, and files that are not to be read."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from spinewatch.imaging.dicom import (
    MAX_HEADER_BYTES,
    DicomAnnotatedError,
    DicomCompressedError,
    DicomError,
    is_dicom,
    read_dicom,
)
from spinewatch.imaging.stated_view import StatedView
from tests.spinewatch.imaging.dicom_files import dicom

RAMP = np.arange(12, dtype=np.uint8).reshape(3, 4) * 10
DEEP = RAMP.astype(np.uint16) * 100


def test_pixels_are_stretched_over_their_values() -> None:
    found = read_dicom(dicom(RAMP))
    np.testing.assert_array_equal(found.pixels, np.rint(RAMP * (255 / 110)))
    assert found.pixels.dtype == np.uint8
    assert (found.pixel_spacing_mm, found.imager_spacing_mm) == ((0.2, 0.18), None)


@pytest.mark.parametrize("implicit", [False, True])
def test_deep_pixels_stay_deep(implicit: bool) -> None:
    found = read_dicom(dicom(DEEP, implicit=implicit)).pixels
    assert found.dtype == np.uint16
    np.testing.assert_array_equal(found, np.rint(DEEP * (65535 / 11000)))


def test_monochrome1_is_inverted() -> None:
    found = read_dicom(dicom(RAMP, PhotometricInterpretation="MONOCHROME1")).pixels
    np.testing.assert_array_equal(found, np.rint(255 - RAMP * (255 / 110)))


def test_the_first_window_is_applied_after_the_rescale() -> None:
    # 2 x - 1000 in the window of centre 1000 and width 2000 runs from 0 at x = 500 to 1 at x = 1500.
    pixels = np.array([[0, 500, 1000, 1500, 4000]], np.uint16)
    content = dicom(
        pixels,
        RescaleSlope="2",
        RescaleIntercept="-1000",
        WindowCenter=["1000", "5"],
        WindowWidth=["2000", "1"],
    )
    np.testing.assert_array_equal(read_dicom(content).pixels, [[0, 0, 32768, 65535, 65535]])


def test_a_window_that_shows_nothing_is_ignored() -> None:
    content = dicom(RAMP, WindowCenter="9000", WindowWidth="10")
    np.testing.assert_array_equal(read_dicom(content).pixels, read_dicom(dicom(RAMP)).pixels)


def test_a_negative_slope_inverts() -> None:
    found = read_dicom(dicom(RAMP, RescaleSlope="-1", RescaleIntercept="0")).pixels
    np.testing.assert_array_equal(found, np.rint(255 - RAMP * (255 / 110)))


def test_signed_samples_keep_their_order() -> None:
    pixels = np.array([[-2000, -1, 0, 1, 2000]], np.int16)
    found = read_dicom(dicom(pixels, signed=True)).pixels.astype(float)
    np.testing.assert_allclose(found / 65535, (pixels + 2000) / 4000, atol=1e-5)


def test_bits_beside_the_stored_ones_are_ignored() -> None:
    pixels = np.array([[0, 0x0FFF, 0xF000, 0xF800]], np.uint16)
    found = read_dicom(dicom(pixels, BitsStored=12, HighBit=11)).pixels
    np.testing.assert_array_equal(found, [[0, 65535, 0, np.rint(0x800 / 0xFFF * 65535)]])
    shifted = read_dicom(dicom(pixels << 4, BitsStored=12, HighBit=15)).pixels
    np.testing.assert_array_equal(shifted, [[0, 65535, 0, np.rint(0x800 / 0xFFF * 65535)]])


def test_an_image_of_one_level_is_read() -> None:
    assert read_dicom(dicom(np.full((2, 2), 7, np.uint8))).pixels.tolist() == [[0, 0], [0, 0]]


def test_the_spacing_at_the_detector_is_told_apart() -> None:
    found = read_dicom(dicom(RAMP, PixelSpacing=None, ImagerPixelSpacing=["0.139", "0.14"]))
    assert (found.pixel_spacing_mm, found.imager_spacing_mm) == (None, (0.139, 0.14))


@pytest.mark.parametrize("spacing", [["0", "0.1"], ["-0.1", "0.1"], ["20", "20"], ["0.1"], ["1e-9", "0.1"]])
def test_an_impossible_spacing_counts_as_none(spacing: list[str]) -> None:
    assert read_dicom(dicom(RAMP, PixelSpacing=spacing)).pixel_spacing_mm is None


def test_spacings_that_differ_too_much_are_refused() -> None:
    assert read_dicom(dicom(RAMP, PixelSpacing=["0.1", "0.2"], ImagerPixelSpacing=["0.1", "0.2"]))
    with pytest.raises(DicomError, match="factor of 2"):
        read_dicom(dicom(RAMP, PixelSpacing=["0.1", "0.21"]))
    with pytest.raises(DicomError, match="factor of 2"):
        read_dicom(dicom(RAMP, ImagerPixelSpacing=["0.1", "0.21"]))


@pytest.mark.parametrize("modality", ["CR", "DX", "RF", "XA", "MG", "OT", "", None])
def test_projections_and_files_without_a_modality_are_read(modality: str | None) -> None:
    assert read_dicom(dicom(RAMP, Modality=modality)).pixels.shape == RAMP.shape


@pytest.mark.parametrize("modality", ["CT", "MR", "US", "XXLONG_VALUE"])
def test_other_modalities_are_refused(modality: str) -> None:
    with pytest.raises(DicomError, match=f"is {modality.replace('_', '')}, not that of a radiograph"):
        read_dicom(dicom(RAMP, Modality=modality))


@pytest.mark.parametrize("implicit", [False, True])
def test_view_and_sides_are_those_of_the_file(implicit: bool) -> None:
    found = read_dicom(dicom(RAMP, implicit=implicit, ViewPosition="PA", PatientOrientation=["LA", "F"]))
    assert found.stated_view == StatedView("PA", "LA", "F")
    assert read_dicom(dicom(RAMP)).stated_view == StatedView()


def test_sequences_and_private_elements_before_the_pixels_are_passed_over() -> None:
    inner = Dataset()
    inner.PatientName = "Hidden^Name"
    inner.Rows = 7
    sequence = Sequence([inner])
    sequence.is_undefined_length = True
    found = read_dicom(dicom(RAMP, RequestAttributesSequence=sequence)).pixels
    assert found.shape == RAMP.shape


@pytest.mark.parametrize(
    "syntax",
    [
        "1.2.840.10008.1.2.1.99",  # deflated
        "1.2.840.10008.1.2.2",  # big-endian
        "1.2.840.10008.1.2.5",  # run lengths
        "1.2.840.10008.1.2.4.50",
        "1.2.840.10008.1.2.4.70",
        "1.2.840.10008.1.2.4.90",
        "1.2.3",
    ],
)
def test_other_transfer_syntaxes_are_refused_with_what_to_do(syntax: str) -> None:
    own = b"1.2.840.10008.1.2.1\0"
    content = dicom(RAMP)
    at = content.index(own)
    length = len(syntax) + len(syntax) % 2
    changed = content[: at - 2] + struct.pack("<H", length) + syntax.encode().ljust(length, b"\0")
    with pytest.raises(DicomCompressedError, match="export it uncompressed"):
        read_dicom(changed + content[at + len(own) :])


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ({"PhotometricInterpretation": "RGB"}, "not gray"),
        ({"PhotometricInterpretation": None}, "not gray"),
        ({"SamplesPerPixel": 3}, "not gray"),
        ({"NumberOfFrames": "2"}, "several frames"),
        ({"NumberOfFrames": "999999999"}, "several frames"),
        ({"Rows": 0}, "no pixels"),
        ({"Rows": 65535, "Columns": 65535}, "more than 32 million"),
        ({"Rows": 400}, "less pixels"),
        ({"Rows": None}, "does not describe"),
        ({"Columns": None}, "does not describe"),
        ({"BitsAllocated": 32}, "8 to 16 bits"),
        ({"BitsStored": 9}, "8 to 16 bits"),
        ({"BitsStored": 0}, "8 to 16 bits"),
        ({"HighBit": 9}, "8 to 16 bits"),
        ({"PixelData": None}, "no pixels"),
    ],
)
def test_images_of_other_kinds_are_refused_with_the_reason(elements: dict[str, Any], message: str) -> None:
    with pytest.raises(DicomError, match=message):
        read_dicom(dicom(RAMP, **elements))


def test_text_in_the_pixels_is_refused() -> None:
    with pytest.raises(DicomAnnotatedError, match="name the patient"):
        read_dicom(dicom(RAMP, BurnedInAnnotation="YES").replace(b"YES ", b"yes "))
    with pytest.raises(DicomAnnotatedError, match="name the patient"):
        read_dicom(dicom(RAMP, BurnedInAnnotation="YES"))
    assert read_dicom(dicom(RAMP, BurnedInAnnotation="NO")).pixels.size


def test_other_files_are_no_dicom() -> None:
    assert not is_dicom(b"")
    assert not is_dicom(b"DICM" + bytes(200))
    with pytest.raises(DicomError, match="not a DICOM file"):
        read_dicom(b"\x89PNG")


CONTENT = dicom(DEEP, WindowCenter="5000", WindowWidth="3000")


@given(st.integers(0, len(CONTENT)))
def test_a_truncated_file_is_refused_by_name(length: int) -> None:
    if length == len(CONTENT):
        return
    with pytest.raises(DicomError):
        read_dicom(CONTENT[:length])


@settings(max_examples=400)
@given(st.lists(st.tuples(st.integers(128, len(CONTENT) - 1), st.binary(min_size=1, max_size=6)), max_size=4))
def test_a_damaged_file_is_read_or_refused_by_name(damage: list[tuple[int, bytes]]) -> None:
    content = bytearray(CONTENT)
    for at, value in damage:
        content[at : at + len(value)] = value
    try:
        found = read_dicom(bytes(content))
    except DicomError:
        return
    assert found.pixels.ndim == 2


def prefix() -> bytes:
    return CONTENT[: CONTENT.index(b"\x08\x00\x05\x00CS")]


def element(group: int, number: int, vr: bytes, value: bytes) -> bytes:
    return struct.pack("<HH2sH", group, number, vr, len(value)) + value


NESTED = struct.pack("<HH2sHL", 0x0040, 0x0275, b"SQ", 0, 0xFFFFFFFF) + struct.pack(
    "<HHL", 0xFFFE, 0xE000, 0xFFFFFFFF
)


@pytest.mark.parametrize(
    ("hostile", "message"),
    [
        (element(0x0009, 0x0010, b"LO", b"") * 500_000, "too many elements"),
        (NESTED * 100_000, "too many elements"),
        (NESTED * 2000, "damaged"),
        (NESTED + element(0x0009, 0x0010, b"LO", b"") * 500_000, "no pixels|damaged"),
        (NESTED[:12] + struct.pack("<HHL", 0xFFFE, 0xE000, 0) * 500_000, "too many elements"),
        (element(0x0008, 0x0005, b"CS", b"\\" * 65_000) * 100, "too long"),
        (element(0x0028, 0x0030, b"DS", b"1\\" * 30_000) * 100, "too long"),
        (bytes(MAX_HEADER_BYTES), "too many elements"),
    ],
    ids=["elements", "depth", "depth of few", "within", "items", "character sets", "values", "zeros"],
)
def test_a_hostile_header_is_refused_by_name(hostile: bytes, message: str) -> None:
    with pytest.raises(DicomError, match=message):
        read_dicom(prefix() + hostile)


def test_pixels_after_a_long_header_are_refused() -> None:
    long = struct.pack("<HH2sHL", 0x0009, 0x1001, b"OB", 0, MAX_HEADER_BYTES) + bytes(MAX_HEADER_BYTES)
    tail = CONTENT[CONTENT.index(b"\x28\x00\x02\x00US") :]
    with pytest.raises(DicomError, match="begin after 2 MiB"):
        read_dicom(prefix() + long + tail)
