"""Similarity of templates with an image at each pixel: ED, OCC, CCN, CCM and RHO, defined by direct sums.

An image here has C planes (one for gray levels, two for gradient vectors). Sums run over the template's planes and over
the pixels of its mask, so that templates are round, not square. The window of the image below a template is the
"shadow" of the thesis. `spinewatch.detection.candidates.correlation` computes the same by Fourier transforms.

References
----------
Thesis section 4.3.1 and appendix A.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from spinewatch.arrays import Floating

_MIN_ENERGY = 1e-6
"""Windows of less energy per pixel (squared gray levels) are flat: their normalized similarity is 0."""


class Measure(StrEnum):
    """The five measures of Table 4.1."""

    ED = "ED"
    """Euclidean distance, eq. 4.6; small for similar windows."""
    OCC = "OCC"
    """Cross-correlation, eq. 4.9 (the thesis's orthodox cross-correlation)."""
    CCN = "CCN"
    """Normalized cross-correlation, eq. 4.12, in [-1, 1]."""
    CCM = "CCM"
    """Cross-correlation of mean-free windows, eq. 4.16."""
    RHO = "RHO"
    """Correlation coefficient: mean-free and normalized, eq. 4.14, in [-1, 1]."""


@dataclass(frozen=True, eq=False)
class Templates:
    """Templates that share a mask.

    Attributes
    ----------
    planes
        Templates, shape (n, C, h, w), h and w odd.
    mask
        1 at the pixels that count, else 0, shape (h, w).
    """

    planes: Floating
    mask: Floating

    @property
    def half(self) -> tuple[int, int]:
        """Half height and half width, px."""
        return self.mask.shape[0] // 2, self.mask.shape[1] // 2


def similarity_spatial(image: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity of templates at each pixel of an image, by direct sums.

    Parameters
    ----------
    image
        Planes, shape (C, H, W); continued beyond the border by reflection.
    templates
        n templates of C planes.
    measure
        Measure of similarity.

    Returns
    -------
    Floating
        Similarity, shape (n, H, W).

    Examples
    --------
    >>> ramp = np.arange(25.0).reshape(1, 5, 5)
    >>> template = Templates(ramp[None, :, 1:4, 1:4], np.ones((3, 3)))
    >>> similarity_spatial(ramp, template, Measure.ED)[0, 2, 2]
    np.float64(0.0)
    """
    h, w = (n + k - 1 for n, k in zip(image.shape[1:], templates.mask.shape, strict=True))
    padded = np.stack([extend_by_reflection(plane, templates.half, (h, w)) for plane in image])
    windows = np.lib.stride_tricks.sliding_window_view(padded, templates.mask.shape, axis=(1, 2))
    windows = np.moveaxis(windows, 0, 2)  # (H, W, C, h, w)
    return np.stack([compare_windows(row, templates, measure) for row in windows]).transpose(2, 0, 1)


def compare_windows(windows: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity of windows with templates.

    Parameters
    ----------
    windows
        Windows of an image, shape (m, C, h, w).
    templates
        n templates of the same size.
    measure
        Measure of similarity.

    Returns
    -------
    Floating
        Similarity, shape (m, n).
    """
    inside = templates.mask > 0
    g = windows[..., inside]  # (m, C, pixels)
    t = templates.planes[..., inside]
    if measure in (Measure.CCM, Measure.RHO):
        g = g - g.mean(axis=-1, keepdims=True)
        t = t - t.mean(axis=-1, keepdims=True)
    g, t = g.reshape(len(g), -1), t.reshape(len(t), -1)
    product = g @ t.T
    if measure in (Measure.OCC, Measure.CCM):
        return np.asarray(product)
    energy, own = (g * g).sum(axis=1), (t * t).sum(axis=1)
    if measure is Measure.ED:
        return np.asarray(np.sqrt(np.maximum(energy[:, None] - 2 * product + own, 0)))
    return normalize_product(product, energy[:, None], own, g.shape[1])


def normalize_product(product: Floating, energy: Floating, own: Floating, terms: int) -> Floating:
    """Return normalized scalar products of windows and templates.

    Parameters
    ----------
    product
        Scalar products; overwritten.
    energy
        Sums of squares of the windows, broadcast against the products.
    own
        Sums of squares of the templates, broadcast against the products.
    terms
        Number of terms of a sum.

    Returns
    -------
    Floating
        ``product / sqrt(energy own)``, the same array; 0 where a window is flat.
    """
    floor = _MIN_ENERGY * terms
    scale = np.sqrt(np.maximum(energy, floor)).astype(product.dtype, copy=False)
    product /= scale
    product /= np.sqrt(np.maximum(own, floor)).astype(product.dtype, copy=False)
    product *= energy > floor
    return product


def extend_by_reflection(plane: Floating, before: tuple[int, int], size: tuple[int, int]) -> Floating:
    """Return a plane that is continued by reflection on all sides.

    Parameters
    ----------
    plane
        Gray levels, shape (H, W).
    before
        Number of rows and of columns added before the first pixel.
    size
        Height and width of the result, px.

    Returns
    -------
    Floating
        Plane of that size; the border pixel is repeated only where the plane is too small to reflect about it.
    """
    (a, b), (h, w) = before, plane.shape
    border = cv2.BORDER_REFLECT_101 if h > a and w > b else cv2.BORDER_REFLECT
    return np.asarray(cv2.copyMakeBorder(plane, a, size[0] - h - a, b, size[1] - w - b, border))
