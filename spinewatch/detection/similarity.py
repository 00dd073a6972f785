"""Similarity of templates with every place of an image: ED, OCC, CCN, CCM and RHO (section 4.3.1, appendix A).

An image here has C planes (one for gray levels, two for gradient vectors); sums run over the template's
planes and over the pixels of its mask, so that templates are round and not square.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Floating = NDArray[np.floating]


class Measure(StrEnum):
    """The five measures of Table 4.1."""

    ED = "ED"
    """Euclidean difference, eq. 4.6; small where alike."""
    OCC = "OCC"
    """Orthodox cross-correlation, eq. 4.9."""
    CCN = "CCN"
    """Cross-correlation with normalisation, eq. 4.12, in [-1, 1]."""
    CCM = "CCM"
    """Cross-correlation with means adjustment, eq. 4.16."""
    RHO = "RHO"
    """Correlation coefficient: both, eq. 4.14, in [-1, 1]."""


@dataclass(frozen=True, eq=False)
class Templates:
    """Templates (n, C, h, w) of odd height and width that share a mask (h, w) of 0 and 1."""

    planes: Floating
    mask: Floating

    @property
    def half(self) -> tuple[int, int]:
        """Half height and half width."""
        return self.mask.shape[0] // 2, self.mask.shape[1] // 2


# Shadows with less energy than this per pixel (gray levels squared) are flat: they resemble nothing.
_FLAT = 1e-6


def similarity_spatial(image: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity (n, H, W) of n templates at each pixel of planes (C, H, W), by direct sums.

    Beyond its border the image is continued by reflection. This form is the definition; ``similarity`` is the
    fast one.
    """
    windows = np.lib.stride_tricks.sliding_window_view(
        _pad(image, templates), templates.mask.shape, axis=(1, 2)
    )
    shadows = np.moveaxis(windows, 0, 2)  # (H, W, C, h, w)
    return np.stack([compare_shadows(row, templates, measure) for row in shadows]).transpose(2, 0, 1)


def compare_shadows(shadows: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity (m, n) of m shadows (m, C, h, w) with n templates."""
    inside = templates.mask > 0
    g = shadows[..., inside]  # (m, C, pixels)
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
    return _normalise(product, energy[:, None], own, g.shape[1])


def similarity(image: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity (n, H, W) of n templates at each pixel of planes (C, H, W), by Fourier transforms.

    Appendix A: a mean-adjusted template makes the shadow's mean drop out of the numerator, and the shadow's
    energy is a correlation of the squared image with the mask. Equal to ``similarity_spatial`` but for
    rounding; the precision of the image (float32 or float64) is kept.
    """
    mask = templates.mask.astype(image.dtype)
    pixels = mask.sum()
    t = templates.planes.astype(image.dtype) * mask
    adjust = measure in (Measure.CCM, Measure.RHO)
    if adjust:
        t = (t - t.sum(axis=(-2, -1), keepdims=True) / pixels) * mask
        image = image - image.mean(axis=(1, 2), keepdims=True)
    correlation = _Correlator(_pad(image, templates), templates.mask.shape)
    product = correlation(t)
    if measure in (Measure.OCC, Measure.CCM):
        return product
    squared = _pad(np.einsum("chw,chw->hw", image, image)[None], templates)
    energy = _Correlator(squared, mask.shape)(mask[None, None])[0]
    if measure is Measure.RHO:
        for plane in range(len(image)):
            only = np.zeros((1, len(image), *mask.shape), dtype=image.dtype)
            only[0, plane] = mask
            energy = energy - correlation(only)[0] ** 2 / pixels
    own = (t * t).sum(axis=(1, 2, 3))[:, None, None]
    if measure is Measure.ED:
        return np.asarray(np.sqrt(np.maximum(energy - 2 * product + own, 0)))
    return _normalise(product, energy, own, int(pixels) * len(image))


def _normalise(product: Floating, energy: Floating, own: Floating, terms: int) -> Floating:
    floor = _FLAT * terms
    scale = np.where(energy > floor, 1 / np.sqrt(np.maximum(energy, floor)), 0)
    return np.asarray(
        product * scale.astype(product.dtype) / np.sqrt(np.maximum(own, floor)).astype(product.dtype)
    )


def _pad(image: Floating, templates: Templates) -> Floating:
    (a, b), (h, w) = templates.half, image.shape[1:]
    mode = "reflect" if h > a and w > b else "symmetric"
    return np.pad(image, ((0, 0), (a, a), (b, b)), mode=mode)  # type: ignore[call-overload,no-any-return]


class _Correlator:
    """Correlates one padded image with several kernels, transforming the image once.

    OpenCV's transform takes half the time of SciPy's for such sizes.
    """

    def __init__(self, padded: Floating, kernel: tuple[int, ...]) -> None:
        self.out = tuple(n - k + 1 for n, k in zip(padded.shape[1:], kernel, strict=True))
        # Wrap-around falls on the margin that is cut off, so the padded size is enough.
        self.size = tuple(cv2.getOptimalDFTSize(n) for n in padded.shape[1:])
        self.spectra = [self._transform(plane) for plane in padded]

    def __call__(self, kernels: Floating) -> Floating:
        h, w = self.out
        out = np.empty((len(kernels), h, w), dtype=kernels.dtype)
        for result, kernel in zip(out, kernels, strict=True):
            products = [
                cv2.mulSpectrums(image, self._transform(plane), 0, conjB=True)
                for image, plane in zip(self.spectra, kernel, strict=True)
            ]
            total = products[0] if len(products) == 1 else np.add.reduce(products)
            result[:] = cv2.idft(total, flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT)[:h, :w]
        return out

    def _transform(self, plane: Floating) -> NDArray[Any]:
        field = np.zeros(self.size, dtype=plane.dtype)
        field[: plane.shape[0], : plane.shape[1]] = plane
        return cv2.dft(field, nonzeroRows=plane.shape[0])  # a kernel has few rows: half of the time
