"""Radiographs in DICOM files: pixels, pixel spacing, view and sides, and nothing else.

pydicom walks the elements of the data set, of which only those of `_WANTED` are read; their values stay bytes and are
interpreted here. The cost is bounded before anything is read: the header must end within `MAX_HEADER_BYTES`, has a
limited number of elements, and compressed files, whose size after decompression is not known before, are refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from math import isfinite

import numpy as np
from numpy.typing import NDArray
from pydicom.filereader import data_element_generator
from pydicom.tag import BaseTag

from spinewatch.arrays import Float, Pixels
from spinewatch.errors import ImageError
from spinewatch.imaging.pixel_spacing import LARGEST_SPACING_RATIO, are_unequal_spacings, plausible_spacing
from spinewatch.imaging.stated_view import StatedView

MAX_HEADER_BYTES = 2 << 20
"""Longest part of a file before its pixels that is read."""

MAX_RADIOGRAPH_PIXELS = 32_000_000
"""Largest radiograph that is decoded, px: a film of 350 x 900 mm at 0.1 mm."""


class DicomError(ImageError):
    """A DICOM file cannot be read: damaged, without an image, or of a kind that is not supported."""

    code = "invalid-dicom"


class DicomCompressedError(DicomError):
    """A DICOM file is compressed."""

    code = "dicom-compressed"


class DicomAnnotatedError(DicomError):
    """The pixels of a DICOM file have text burned in, which may name the patient."""

    code = "dicom-annotated"


@dataclass(frozen=True, eq=False)
class DicomRadiograph:
    """What is taken from a DICOM file.

    Attributes
    ----------
    pixels
        Gray levels for display, black to white, shape (H, W); uint16 for samples of more than 8 bits, else uint8.
    pixel_spacing_mm
        Distance of rows and columns at the patient (Pixel Spacing), mm; None if the file does not have it.
    imager_spacing_mm
        The same at the detector (Imager Pixel Spacing), where the patient appears magnified, mm, or None.
    stated_view
        View and sides, as far as the file says them.
    """

    pixels: Pixels
    pixel_spacing_mm: tuple[float, float] | None
    imager_spacing_mm: tuple[float, float] | None
    stated_view: StatedView


def is_dicom(data: bytes) -> bool:
    """Return whether a file is in the DICOM format.

    Parameters
    ----------
    data
        Contents of the file.

    Returns
    -------
    bool
        Whether it has the preamble and prefix of PS3.10.

    Examples
    --------
    >>> is_dicom(bytes(128) + b"DICM")
    True
    """
    return data[_PREAMBLE:_META_START] == b"DICM"


def read_dicom(data: bytes) -> DicomRadiograph:
    """Return the pixels and the pixel spacing of a radiograph.

    Parameters
    ----------
    data
        Contents of the file: one gray image, uncompressed.

    Returns
    -------
    DicomRadiograph
        Gray levels after the rescale and the first window of the file, or stretched over its values if it has none, and
        inverted for MONOCHROME1. Lookup tables of the file are ignored.

    Raises
    ------
    DicomError
        If the file is damaged or of a kind that is not supported.

    References
    ----------
    DICOM PS3.3 C.7.6.3 (pixels), C.11.1 (rescale), C.11.2.1.3 (window; always as LINEAR_EXACT, half a stored level from
    LINEAR); PS3.5 section 8.
    """
    try:
        return _read(data)
    except DicomError:
        raise
    except Exception as error:  # parsers of hostile bytes raise exceptions of any class
        raise DicomError("the DICOM file is damaged; export it again") from error


_PREAMBLE, _META_START = 128, 132
_PIXELS, _CHARACTER_SET = 0x7FE00010, 0x00080005
_SYNTAX = 0x00020010
_SPACING, _IMAGER_SPACING, _ANNOTATED = 0x00280030, 0x00181164, 0x00280301
_MODALITY, _VIEW_POSITION, _ORIENTATION = 0x00080060, 0x00185101, 0x00200020
_SAMPLES, _PHOTOMETRIC, _FRAMES, _ROWS, _COLUMNS = 0x00280002, 0x00280004, 0x00280008, 0x00280010, 0x00280011
_ALLOCATED, _STORED, _HIGH_BIT, _SIGNED = 0x00280100, 0x00280101, 0x00280102, 0x00280103
_CENTRE, _WIDTH, _INTERCEPT, _SLOPE = 0x00281050, 0x00281051, 0x00281052, 0x00281053
_WANTED = (
    *(_MODALITY, _VIEW_POSITION, _ORIENTATION),
    *(_SPACING, _IMAGER_SPACING, _ANNOTATED, _SAMPLES, _PHOTOMETRIC, _FRAMES, _ROWS, _COLUMNS),
    *(_ALLOCATED, _STORED, _HIGH_BIT, _SIGNED, _CENTRE, _WIDTH, _INTERCEPT, _SLOPE),
)
_IMPLICIT_TYPES = {"1.2.840.10008.1.2": True, "1.2.840.10008.1.2.1": False}
"""Transfer syntaxes that are read, both little-endian and uncompressed: whether types of values are implicit."""

_PROJECTIONS = frozenset({"CR", "DX", "DR", "RF", "XA", "MG", "RG", "OT"})
"""Modalities of projection radiographs, and of digitized films."""
_MAX_ELEMENTS = 5000
_MAX_ITEMS = 10_000
_ITEM = bytes.fromhex("feff00e0")
_MAX_VALUE_BYTES = 1024
_UNDEFINED_LENGTH = 0xFFFFFFFF
_TOO_LONG = "the header of the DICOM file has too many elements or too long ones; export the image alone"


@dataclass(frozen=True)
class _Header:
    """Values of the wanted elements as bytes, and where the pixels are."""

    values: Mapping[int, bytes]
    start: int
    length: int

    def integer(self, tag: int, default: int | None = None) -> int:
        value = self.values.get(tag)
        if value is None and default is not None:
            return default
        if value is None or len(value) != 2:
            raise DicomError("the DICOM file does not describe its pixels; export it again")
        return int.from_bytes(value, "little")

    def text(self, tag: int) -> str:
        return self.values.get(tag, b"").decode("ascii", "replace").strip(" \0")

    def numbers(self, tag: int) -> tuple[float, ...]:
        text = self.text(tag)
        return tuple(float(part) for part in text.split("\\")) if text else ()


def _read(data: bytes) -> DicomRadiograph:
    if not is_dicom(data):
        raise DicomError("the file is not a DICOM file; export it again")
    header = _header(data)
    modality = header.text(_MODALITY).upper()
    if modality and modality not in _PROJECTIONS:
        raise DicomError(
            f"the modality of the DICOM file is {_shown(modality)}, not that of a radiograph; send a projection"
            f" radiograph ({', '.join(sorted(_PROJECTIONS))})"
        )
    if header.text(_ANNOTATED).upper() == "YES":
        raise DicomAnnotatedError(
            "the image has text burned into its pixels, which may name the patient; export it without annotations"
        )
    stored = _stored_values(data, header)
    spacing, imager = _spacing(header, _SPACING), _spacing(header, _IMAGER_SPACING)
    return DicomRadiograph(_displayed(stored, header), spacing, imager, _stated_view(header))


def _shown(text: str) -> str:
    """Return a value of a file for a message."""
    return "".join(letter for letter in text if letter.isalnum())[:16]


def _stated_view(header: _Header) -> StatedView:
    """Return what the file says of the view and the sides."""
    rows, _, columns = header.text(_ORIENTATION).partition("\\")
    return StatedView(header.text(_VIEW_POSITION), rows.strip(), columns.strip())


def _transfer_syntax(data: bytes) -> tuple[str, int]:
    """Return the transfer syntax and where the data set starts, from the elements of group 2 (PS3.10 section 7.1)."""
    fp = BytesIO(data[:MAX_HEADER_BYTES])
    fp.seek(_META_START)
    syntax = ""
    for count, element in enumerate(
        data_element_generator(
            fp, False, True, lambda tag, vr, length: tag.group != 2, specific_tags=[BaseTag(_SYNTAX)]
        )
    ):
        if count > _MAX_ELEMENTS:
            raise DicomError(_TOO_LONG)
        if element.tag == _SYNTAX:
            syntax = bytes(element.value or b"").decode("ascii").strip(" \0")
    return syntax, fp.tell()


def _header(data: bytes) -> _Header:
    """Return the wanted elements before the pixels."""
    syntax, start = _transfer_syntax(data)
    if syntax not in _IMPLICIT_TYPES:
        raise DicomCompressedError(
            "the pixels of the DICOM file are compressed, or its transfer syntax is unknown; export it uncompressed"
            " (Explicit VR Little Endian), or as PNG with the pixel spacing"
        )
    readable = data[:MAX_HEADER_BYTES]
    if readable.count(_ITEM, start) > _MAX_ITEMS:
        raise DicomError(_TOO_LONG)
    fp = BytesIO(readable)
    fp.seek(start)
    found: list[tuple[int, int]] = []
    seen = 0

    def stop(tag: BaseTag, vr: str | None, length: int) -> bool:
        nonlocal seen
        seen += 1
        if seen > _MAX_ELEMENTS or (tag in (*_WANTED, _CHARACTER_SET) and length > _MAX_VALUE_BYTES):
            raise DicomError(_TOO_LONG)
        if tag == _PIXELS:
            found.append((fp.tell(), length))
        return bool(tag >= _PIXELS)

    values = {
        int(element.tag): bytes(element.value or b"")
        for element in data_element_generator(
            fp, _IMPLICIT_TYPES[syntax], True, stop, specific_tags=[BaseTag(tag) for tag in _WANTED]
        )
        if int(element.tag) in _WANTED
    }
    if not found:
        raise DicomError(
            f"the DICOM file has no pixels, or they begin after {MAX_HEADER_BYTES >> 20} MiB; export the image alone"
        )
    return _Header(values, *found[0])


def _stored_values(data: bytes, header: _Header) -> NDArray[np.int32]:
    """Return the stored values (H, W), after all checks of the size."""
    rows, columns = header.integer(_ROWS), header.integer(_COLUMNS)
    frames = header.text(_FRAMES) or "1"
    if header.integer(_SAMPLES, 1) != 1 or header.text(_PHOTOMETRIC) not in {"MONOCHROME1", "MONOCHROME2"}:
        raise DicomError("the image of the DICOM file is not gray; export it as MONOCHROME2, or as PNG")
    if frames != "1":
        raise DicomError("the DICOM file holds several frames; send one image per file")
    if not 0 < rows * columns <= MAX_RADIOGRAPH_PIXELS:
        raise DicomError(
            f"the image has no pixels or more than {MAX_RADIOGRAPH_PIXELS // 1_000_000} million; export it smaller"
        )
    allocated, stored = header.integer(_ALLOCATED), header.integer(_STORED)
    high = header.integer(_HIGH_BIT, stored - 1)
    if allocated not in (8, 16) or not 0 < stored <= high + 1 <= allocated:
        raise DicomError("the samples of the DICOM file have not 8 to 16 bits; export it with 8 or 16 bits")
    size = rows * columns * allocated // 8
    if header.length == _UNDEFINED_LENGTH or header.length < size or len(data) < header.start + size:
        raise DicomError("the DICOM file has less pixels than its header says; copy it again")
    raw = np.frombuffer(data, f"<u{allocated // 8}", rows * columns, header.start).reshape(rows, columns)
    values = (raw.astype(np.int32) >> (high + 1 - stored)) & ((1 << stored) - 1)
    if header.integer(_SIGNED, 0):
        values -= (values >> (stored - 1)) << stored
    return values


def _displayed(stored: NDArray[np.int32], header: _Header) -> Pixels:
    """Return the gray levels that a viewer shows."""
    slope, intercept = (
        (header.numbers(tag) or (default,))[0] for tag, default in ((_SLOPE, 1.0), (_INTERCEPT, 0.0))
    )
    if not (isfinite(slope) and isfinite(intercept) and slope):
        slope, intercept = 1.0, 0.0
    lowest, highest = int(stored.min()), int(stored.max())
    levels = np.asarray(slope * np.arange(lowest, highest + 1) + intercept, np.float64)
    share = _windowed(levels, header)
    if header.text(_PHOTOMETRIC) == "MONOCHROME1":
        share = 1 - share
    stored -= lowest
    if header.integer(_STORED) > 8:
        return np.rint(share * 65535).astype(np.uint16)[stored]
    return np.rint(share * 255).astype(np.uint8)[stored]


def _windowed(levels: Float, header: _Header) -> Float:
    """Return values (n,) as shares of white, by the first window of the file or by their own range."""
    centre, width = ((header.numbers(tag) or (np.nan,))[0] for tag in (_CENTRE, _WIDTH))
    if isfinite(centre) and isfinite(width) and width >= 1:
        share = np.clip((levels - centre) / width + 0.5, 0, 1)
        if np.ptp(share) > 0:
            return share
    low, high = levels.min(), levels.max()
    return np.asarray((levels - low) / max(high - low, 1e-12))


def _spacing(header: _Header, tag: int) -> tuple[float, float] | None:
    """Return a spacing of rows and columns, mm; None if it is missing or impossible."""
    numbers = header.numbers(tag)
    if are_unequal_spacings(numbers):
        raise DicomError(
            "the pixel spacings of rows and columns in the DICOM file differ by more than a factor of"
            f" {LARGEST_SPACING_RATIO:g}; export it again, or as PNG with the pixel spacing"
        )
    return plausible_spacing(numbers)
