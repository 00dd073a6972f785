"""Property spaces: gray level, edge magnitude and directivity (thesis sections 4.2.4 and 4.3.2)."""

from __future__ import annotations

from enum import StrEnum

import cv2
import numpy as np

from spinewatch.arrays import Single


class PropertySpace(StrEnum):
    """The property of the pixels that templates are compared with."""

    GRAY = "gray"
    EDGE = "edge"
    DIRECTIVITY = "directivity"


def property_planes(gray: Single, space: PropertySpace) -> Single:
    """Return an image in a property space.

    Parameters
    ----------
    gray
        Gray levels, shape (H, W).
    space
        Gray: the image itself. Edge: magnitude of the 3 x 3 Sobel gradient. Directivity: the gradient vector.

    Returns
    -------
    Single
        Planes, shape (C, H, W); C is 2 for directivity, else 1.

    References
    ----------
    Thesis eq. 4.4 and 4.5. The thesis proposes the bare direction for directivity; it is noise where an image is
    smooth, so here each direction has its magnitude as weight.

    Examples
    --------
    >>> ramp = np.tile(np.arange(5, dtype=np.float32), (5, 1))
    >>> property_planes(ramp, PropertySpace.DIRECTIVITY)[:, 2, 2]
    array([8., 0.], dtype=float32)
    """
    if space is PropertySpace.GRAY:
        return gray[None]
    gradient = sobel(gray)
    if space is PropertySpace.EDGE:
        return np.asarray(cv2.magnitude(gradient[0], gradient[1]), dtype=np.float32)[None]
    return gradient


def sobel(gray: Single) -> Single:
    """Return the 3 x 3 Sobel responses of an image.

    Parameters
    ----------
    gray
        Gray levels, shape (H, W).

    Returns
    -------
    Single
        Responses along u and v, shape (2, H, W), eight times the gradient per pixel.

    References
    ----------
    Thesis fig. 4.23.
    """
    gradient = np.empty((2, *gray.shape), np.float32)
    cv2.Sobel(gray, cv2.CV_32F, 1, 0, dst=gradient[0], ksize=3)
    cv2.Sobel(gray, cv2.CV_32F, 0, 1, dst=gradient[1], ksize=3)
    return gradient
