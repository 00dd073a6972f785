"""Decoding of image files to gray levels.

Pillow decodes all four formats: OpenCV 4.14 reads 8-bit gray Sun rasters without a colour map as black, rotates TIFFs
by their orientation tag even with the flag that forbids it, and prints its own messages on stderr.
"""

from __future__ import annotations

import numpy as np
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.errors import ImageError
from spinewatch.imaging.header import open_image, orientation

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
    as it was read out. Colour is converted to luma (ITU-R BT.601) with its upper 8 bits; transparency is ignored.

    Parameters
    ----------
    data
        Contents of a PNG, TIFF, JPEG or Sun raster file.

    Returns
    -------
    Pixels
        Gray levels, shape (H, W); uint16 for 16-bit gray, else uint8.

    Raises
    ------
    ImageError
        As `inspect_image`, and for a truncated or damaged file.

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
        try:
            image.load()
            stored = image if undo is None else image.transpose(undo)
            return _gray(stored)
        except Exception as error:  # decoders of hostile bytes raise exceptions of any class
            raise ImageError("the image is damaged or incomplete; copy it again") from error


def _gray(image: Image.Image) -> Pixels:
    """Return the gray levels (H, W) of a decoded image."""
    if image.mode.startswith("I;16"):
        return np.asarray(image).astype(np.uint16)
    if image.mode in ("P", "PA"):
        image = image.convert("RGBA")
    return np.array(image.convert("L"))
