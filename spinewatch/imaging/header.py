"""The header of an uploaded picture: what it is and how large, read without decoding a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO

from PIL import Image

from spinewatch.errors import ImageError

MAX_PIXELS = 64_000_000
"""Largest picture that is ever decoded: some 270 frames of the 568 x 416 cart."""

_MEDIA_TYPES = {
    "PNG": "image/png",
    "TIFF": "image/tiff",
    "JPEG": "image/jpeg",
    "SUN": "image/x-sun-raster",
}
_FORMATS = tuple(_MEDIA_TYPES)
_NOT_GRAY = frozenset({"I", "F"})  # 32-bit samples have no agreed white
_TURNED = frozenset({5, 6, 7, 8})
_ORIENTATION_TAG = 274


@dataclass(frozen=True)
class ImageHeader:
    """What a file claims to hold: ``kind`` (PNG, TIFF, JPEG, SUN), ``media_type``, size in px as stored."""

    kind: str
    media_type: str
    width: int
    height: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.width, self.height


def inspect_image(data: bytes) -> ImageHeader:
    """Return the header of a single gray or colour picture; no pixel is decoded.

    Raises ``ImageError`` for anything but a PNG, TIFF, JPEG or Sun raster picture of up to ``MAX_PIXELS``.
    """
    with open_image(data) as image:
        width, height = image.size
        if orientation(image) in _TURNED:
            width, height = height, width
        kind = str(image.format)
    return ImageHeader(kind, _MEDIA_TYPES[kind], width, height)


def open_image(data: bytes) -> Image.Image:
    """Return the checked but undecoded Pillow image; raises as ``inspect_image``."""
    if not data:
        raise ImageError("the file is empty; copy it again")
    try:
        image = Image.open(BytesIO(data), formats=_FORMATS)
        several = bool(getattr(image, "is_animated", False))
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise ImageError(_too_large()) from error
    except Exception as error:  # a parser of hostile bytes raises whatever it likes
        raise ImageError("the file is not a PNG, TIFF, JPEG or Sun raster picture, or is damaged") from error
    if several:
        raise ImageError("the file holds several pictures; send one picture a file")
    if image.mode in _NOT_GRAY:
        raise ImageError("the picture has 32-bit samples; export it with 8 or 16 bits")
    if image.width * image.height > MAX_PIXELS:
        raise ImageError(_too_large())
    return image


def orientation(image: Image.Image) -> int:
    """Return the orientation that Pillow applies to an image by itself: of a TIFF its tag, of others 1."""
    tags = getattr(image, "tag_v2", {}) if image.format == "TIFF" else {}
    return int(tags.get(_ORIENTATION_TAG, 1))


def _too_large() -> str:
    return f"the picture has more than {MAX_PIXELS // 1_000_000} million pixels; send the camera's own frame"
