"""Property spaces: gray level, edge magnitude and directivity (thesis section 4.2.4 and 4.3.2)."""

from __future__ import annotations

from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

Planes = NDArray[np.float32]


class PropertySpace(StrEnum):
    """What a pixel stands for when templates are compared."""

    GRAY = "gray"
    EDGE = "edge"
    DIRECTIVITY = "directivity"


def property_planes(gray: NDArray[np.float32], space: PropertySpace) -> Planes:
    """Return the planes (C, H, W) of a property space of an image (H, W).

    Gray: the image itself. Edge: magnitude of the 3x3 Sobel gradient (eq. 4.4). Directivity: the gradient as
    a vector, two planes; the thesis proposed the bare direction (eq. 4.5), but a direction without its
    magnitude is noise where the image is smooth, so each direction carries its magnitude as weight.
    """
    if space is PropertySpace.GRAY:
        return gray[None]
    gradient = sobel(gray)
    if space is PropertySpace.EDGE:
        return np.asarray(cv2.magnitude(gradient[0], gradient[1]), dtype=np.float32)[None]
    return gradient


def sobel(gray: NDArray[np.float32]) -> Planes:
    """Return the 3x3 Sobel responses (2, H, W) along u and v (fig. 4.23)."""
    gradient = np.empty((2, *gray.shape), np.float32)
    cv2.Sobel(gray, cv2.CV_32F, 1, 0, dst=gradient[0], ksize=3)
    cv2.Sobel(gray, cv2.CV_32F, 0, 1, dst=gradient[1], ksize=3)
    return gradient
