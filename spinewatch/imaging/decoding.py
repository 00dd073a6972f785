"""Decoding of image files to gray levels.

Pillow decodes all four formats: OpenCV 4.14 reads 8-bit gray Sun rasters without a colour map as black, rotates TIFFs
by their orientation tag even with the flag that forbids it, and prints its own messages on stderr. Pillow's own defects
are worked around: it reduces colour of 16 bits to 8, keeps white as zero in TIFFs of 16 bits, shears Sun rasters with
run lengths at odd widths and hides that a file is damaged (`spinewatch.imaging.damage`).
"""

from __future__ import annotations

import cv2
import numpy as np
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.errors import ImageError
from spinewatch.imaging.damage import DAMAGED, require_undamaged
from spinewatch.imaging.header import open_image, orientation
from spinewatch.imaging.luma import LUMA_BGR
from spinewatch.imaging.sun_raster import decode_padded_runs, has_padded_runs

_PHOTOMETRIC_TAG, _WHITE_IS_ZERO = 262, 0
_BITS_TAG = 258
_PLANES_TAG, _SEPARATE = 284, 2
_PNG_DEPTH_BYTE = 24

_UNDO_ORIENTATION = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_90,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_270,
}


def decode_image(data: bytes) -> Pixels:
    """Return the gray levels of an image file as stored.

    Rows and columns are those of the sensor: an orientation tag is ignored, because a calibration holds for the frame
    as it was read out. Colour is converted to luma (ITU-R BT.601); transparency is ignored.

    Parameters
    ----------
    data
        Contents of a PNG, TIFF, JPEG or Sun raster file.

    Returns
    -------
    Pixels
        Gray levels, shape (H, W); uint16 for samples of 16 bits, else uint8.

    Raises
    ------
    ImageError
        As `inspect_image`, and for a truncated or damaged file, as `require_undamaged`.
    MemoryError
        If the process may not have as much memory as the pixels need.

    Examples
    --------
    >>> from io import BytesIO
    >>> buffer = BytesIO()
    >>> Image.new("RGB", (3, 2), (255, 0, 0)).save(buffer, "PNG")
    >>> decode_image(buffer.getvalue())
    array([[76, 76, 76],
           [76, 76, 76]], dtype=uint8)
    """
    with open_image(data) as image:
        undo = _UNDO_ORIENTATION.get(orientation(image))
        require_undamaged(data, image)
        is_deep = _is_deep_colour(image, data)
        if is_deep and image.format == "TIFF":
            _require_plain_layout(image)
        try:
            image.load()
            if image.format == "SUN" and has_padded_runs(data):
                return decode_padded_runs(data)
            if is_deep:
                return _deep_luma(data)
            stored = image if undo is None else image.transpose(undo)
            gray = _gray(stored)
            if _is_white_zero(image):
                gray = ((1 << image.tag_v2[_BITS_TAG][0]) - 1 - gray).astype(np.uint16)  # type: ignore[attr-defined]
            return gray
        except MemoryError:
            raise
        except Exception as error:  # decoders of hostile bytes raise exceptions of any class
            raise ImageError(DAMAGED) from error


def _gray(image: Image.Image) -> Pixels:
    """Return the gray levels (H, W) of a decoded image."""
    if image.mode.startswith("I;16"):
        return np.asarray(image).astype(np.uint16)
    if image.mode in ("P", "PA"):
        image = image.convert("RGBA")
    return np.array(image.convert("L"))


def _is_white_zero(image: Image.Image) -> bool:
    """Return whether an image is a TIFF of 16 bits with white as zero; Pillow inverts those of 8 bits itself."""
    tags = getattr(image, "tag_v2", {}) if image.format == "TIFF" else {}
    return image.mode.startswith("I;16") and tags.get(_PHOTOMETRIC_TAG) == _WHITE_IS_ZERO


def _is_deep_colour(image: Image.Image, data: bytes) -> bool:
    """Return whether an image has colour with 16 bits per sample."""
    if image.mode not in ("RGB", "RGBA"):
        return False
    if image.format == "TIFF":
        return 16 in getattr(image, "tag_v2", {}).get(_BITS_TAG, ())
    return image.format == "PNG" and data[_PNG_DEPTH_BYTE] == 16


def _require_plain_layout(image: Image.Image) -> None:
    """Refuse a TIFF with colour of 16 bits in a layout that OpenCV does not decode as it is stored."""
    tags = getattr(image, "tag_v2", {})
    if tags.get(_PLANES_TAG) == _SEPARATE:
        raise ImageError(
            "the TIFF image has 16-bit colour in planes one after the other, which is not supported; export it with"
            " interleaved colours, or as gray of 16 bits"
        )
    if orientation(image) in _UNDO_ORIENTATION:
        raise ImageError(
            "the TIFF image has 16-bit colour and an orientation tag, which is not supported; export it without the"
            " tag, or as gray of 16 bits"
        )


def _deep_luma(data: bytes) -> Pixels:
    """Return the luma (H, W), uint16, of an image with colour of 16 bits."""
    bgr = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if bgr is None or bgr.dtype != np.uint16 or bgr.ndim != 3:
        raise ValueError("OpenCV does not decode it")
    luma: Pixels = np.rint(bgr[..., :3] @ np.array(LUMA_BGR)).astype(np.uint16)
    return luma
