"""Frames: one camera's image with its side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from spinewatch.arrays import Pixels, Single
from spinewatch.imaging.tone import to_gray

Side = Literal["left", "right"]
"""The camera of a stereo rig that took an image."""

SIDES: tuple[Side, Side] = ("left", "right")
"""Both sides, in the order in which pairs are given."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of one camera of the rig.

    Attributes
    ----------
    pixels
        Raw gray levels, shape (H, W), 8 or 16 bits.
    side
        Camera that took the image.

    Examples
    --------
    >>> import numpy as np
    >>> frame = Frame(np.full((2, 3), 51, np.uint8), "left")
    >>> frame.size_px
    (3, 2)
    >>> frame.gray()
    array([[51., 51., 51.],
           [51., 51., 51.]], dtype=float32)
    """

    pixels: Pixels
    side: Side

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        height, width = self.pixels.shape
        return width, height

    def gray(self) -> Single:
        """Return the gray levels at a common scale.

        Returns
        -------
        Single
            New array of gray levels of 0..255, shape (H, W).

        Raises
        ------
        ImageError
            When the pixels are not two-dimensional or have other than 8 or 16 bits.
        """
        return to_gray(self.pixels)
