"""From the bytes of a picture to its gray levels.

Pillow decodes all four formats: OpenCV 4.14 reads 8-bit gray Sun rasters without a colour map as black, turns
TIFFs by their orientation tag even when told not to, and prints its own lines on stderr.
"""

from __future__ import annotations

import numpy as np
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.errors import ImageError
from spinewatch.imaging.header import open_image, orientation

_UNDO_TURN = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_90,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_270,
}


def decode_image(data: bytes) -> Pixels:
    """Return the gray levels (H, W) as stored, uint8, or uint16 for 16-bit gray.

    Rows and columns are those of the sensor: an orientation tag is ignored, since a calibration holds for the
    frame as it was read out. Colour becomes luma (ITU-R BT.601), transparency is ignored, 16-bit colour keeps
    its upper 8 bits. Raises ``ImageError`` as ``inspect_image`` does, and for a truncated or damaged file.
    """
    with open_image(data) as image:
        turn = _UNDO_TURN.get(orientation(image))
        try:
            image.load()
            stored = image if turn is None else image.transpose(turn)
            return _gray(stored)
        except Exception as error:  # a decoder of hostile bytes raises whatever it likes
            raise ImageError("the picture is damaged or incomplete; copy it again") from error


def _gray(image: Image.Image) -> Pixels:
    if image.mode.startswith("I;16"):
        return np.asarray(image).astype(np.uint16)
    if image.mode in ("P", "PA"):
        image = image.convert("RGBA")
    return np.array(image.convert("L"))
