"""The header of an uploaded image: format and size, read without decoding a pixel.

The file is first walked here under hard limits: a parser of a library reads whatever the file says, such as millions of
strips or chunks, which costs seconds and hundreds of megabytes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from io import BytesIO

from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging import jpeg_segments, png_chunks, tiff_directory

MAX_PIXELS = 64_000_000
"""Largest image that is decoded: 270 frames of the 568 x 416 cart."""

_MEDIA_TYPES = {
    "PNG": "image/png",
    "TIFF": "image/tiff",
    "JPEG": "image/jpeg",
    "SUN": "image/x-sun-raster",
}
_FORMATS = tuple(_MEDIA_TYPES)
_NOT_GRAY = frozenset({"I", "F"})  # samples of 32 bits have no defined white level
_TRANSPOSED = frozenset({5, 6, 7, 8})
_ORIENTATION_TAG = 274
_SAMPLE_FORMAT_TAG = 339
_BITS_TAG = 258
_SIGNED = 2
_MAX_BITS = 16
_SUN_SIGNATURE = b"\x59\xa6\x6a\x95"
_SUN_SIZE = struct.Struct(">II")
_NO_IMAGE = "the file is not a PNG, TIFF, JPEG or Sun raster image, or is damaged"


@dataclass(frozen=True)
class ImageHeader:
    """Format and size of an image file according to its header.

    Attributes
    ----------
    kind
        File format: PNG, TIFF, JPEG or SUN.
    media_type
        Its media type.
    width, height
        Size as stored, px, without regard to an orientation tag.
    """

    kind: str
    media_type: str
    width: int
    height: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.width, self.height


def inspect_image(data: bytes) -> ImageHeader:
    """Return the header of an image file without decoding its pixels.

    Parameters
    ----------
    data
        Contents of the file.

    Returns
    -------
    ImageHeader
        Format and size.

    Raises
    ------
    ImageError
        When the file is not a single gray or colour image of up to `MAX_PIXELS` in PNG, TIFF, JPEG or Sun raster
        format.

    Examples
    --------
    >>> buffer = BytesIO()
    >>> Image.new("L", (568, 416)).save(buffer, "PNG")
    >>> inspect_image(buffer.getvalue())
    ImageHeader(kind='PNG', media_type='image/png', width=568, height=416)
    """
    with open_image(data) as image:
        width, height = image.size
        if orientation(image) in _TRANSPOSED:
            width, height = height, width
        kind = str(image.format)
    return ImageHeader(kind, _MEDIA_TYPES[kind], width, height)


def open_image(data: bytes) -> Image.Image:
    """Return a checked Pillow image whose pixels are not decoded yet.

    Parameters
    ----------
    data
        Contents of the file.

    Returns
    -------
    PIL.Image.Image
        The image; the caller closes it.

    Raises
    ------
    ImageError
        As `inspect_image`.
    """
    if not data:
        raise ImageError("the file is empty; copy it again")
    width, height = _stored_size(data)
    if width * height > MAX_PIXELS:
        raise ImageError(_too_large())
    try:
        image = Image.open(BytesIO(data), formats=_FORMATS)
        several = bool(getattr(image, "is_animated", False))
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise ImageError(_too_large()) from error
    except Exception as error:  # parsers of hostile bytes raise exceptions of any class
        raise ImageError(_NO_IMAGE) from error
    if several:
        raise ImageError("the file holds several images; send one image per file")
    if _has_signed_samples(image):
        raise ImageError(
            "the image has signed samples, whose black level is not defined; export it without a sign"
        )
    if image.mode in _NOT_GRAY:
        raise ImageError("the image has 32-bit samples; export it with 8 or 16 bits")
    if image.width * image.height > MAX_PIXELS:
        raise ImageError(_too_large())
    return image


def _stored_size(data: bytes) -> tuple[int, int]:
    """Return width and height of a file that can be read at a bounded cost."""
    if data.startswith(png_chunks.SIGNATURE):
        return png_chunks.png_size(data)
    if data.startswith(tiff_directory.SIGNATURES):
        return tiff_directory.tiff_size(data)
    if data.startswith(jpeg_segments.SIGNATURE):
        return jpeg_segments.jpeg_size(data)
    if data.startswith(_SUN_SIGNATURE) and len(data) >= len(_SUN_SIGNATURE) + _SUN_SIZE.size:
        width, height = _SUN_SIZE.unpack_from(data, len(_SUN_SIGNATURE))
        return width, height
    raise ImageError(_NO_IMAGE)


def orientation(image: Image.Image) -> int:
    """Return the EXIF orientation that Pillow applies when it decodes an image.

    Parameters
    ----------
    image
        Image that is not decoded yet.

    Returns
    -------
    int
        The orientation tag of a TIFF, 1 to 8; 1 (none) for other formats, which Pillow decodes as stored.

    Raises
    ------
    ImageError
        If the tag is no whole number, for example bytes or text.
    """
    tags = getattr(image, "tag_v2", {}) if image.format == "TIFF" else {}
    value = tags.get(_ORIENTATION_TAG, 1)
    if not isinstance(value, int):
        raise ImageError(
            "the orientation tag of the image is no number; save the image again, without the tag"
        )
    return value


def _has_signed_samples(image: Image.Image) -> bool:
    """Return whether an image is a TIFF with signed samples of up to 16 bits."""
    tags = getattr(image, "tag_v2", {}) if image.format == "TIFF" else {}
    formats, bits = tags.get(_SAMPLE_FORMAT_TAG, ()), tags.get(_BITS_TAG, (1,))
    return _SIGNED in formats and max(bits) <= _MAX_BITS


def _too_large() -> str:
    return f"the image has more than {MAX_PIXELS // 1_000_000} million pixels; send the camera's own frame"
