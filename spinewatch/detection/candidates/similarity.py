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

from spinewatch.arrays import Floating


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


_STRIP = 4
"""Rows of an image that are transformed together, in heights of the kernel."""

# Shadows with less energy than this per pixel (gray levels squared) are flat: they resemble nothing.
_FLAT = 1e-6


def similarity_spatial(image: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity (n, H, W) of n templates at each pixel of planes (C, H, W), by direct sums.

    Beyond its border the image is continued by reflection. This form is the definition; ``similarity`` is the
    fast one.
    """
    h, w = (n + k - 1 for n, k in zip(image.shape[1:], templates.mask.shape, strict=True))
    padded = np.stack([_continue(plane, templates.half, (h, w)) for plane in image])
    windows = np.lib.stride_tricks.sliding_window_view(padded, templates.mask.shape, axis=(1, 2))
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
    correlation = _Correlator(image, mask.shape)
    product = correlation(t)
    if measure in (Measure.OCC, Measure.CCM):
        return product
    energy = _Correlator(np.einsum("chw,chw->hw", image, image)[None], mask.shape)(mask[None, None])[0]
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
    """Return ``product / sqrt(energy own)``, in place of the product; zero where a shadow is flat."""
    floor = _FLAT * terms
    scale = np.sqrt(np.maximum(energy, floor)).astype(product.dtype, copy=False)
    product /= scale
    product /= np.sqrt(np.maximum(own, floor)).astype(product.dtype, copy=False)
    product *= energy > floor
    return product


def _continue(plane: Floating, half: tuple[int, int], size: tuple[int, int]) -> Floating:
    """Return a plane (H, W) continued by reflection to a size, from ``half`` (rows, columns) before its first pixel."""
    (a, b), (h, w) = half, plane.shape
    border = cv2.BORDER_REFLECT_101 if h > a and w > b else cv2.BORDER_REFLECT
    return np.asarray(cv2.copyMakeBorder(plane, a, size[0] - h - a, b, size[1] - w - b, border))


class _Correlator:
    """Correlates one image with several kernels, transforming the image once, in strips that stay in the cache.

    OpenCV's transform takes half the time of SciPy's for such sizes.
    """

    def __init__(self, image: Floating, kernel: tuple[int, ...]) -> None:
        (self.height, self.width), (high, wide) = image.shape[1:], kernel
        rows = min(_STRIP * high, self.height)
        # Wrap-around falls on the margin that is cut off, so the size of a strip with its margin is enough.
        self.size = cv2.getOptimalDFTSize(rows + high - 1), cv2.getOptimalDFTSize(self.width + wide - 1)
        self.rows = self.size[0] - high + 1
        starts = range(0, self.height, self.rows)
        whole = (starts[-1] + self.size[0], self.size[1])
        planes = [_continue(plane, (high // 2, wide // 2), whole) for plane in image]
        self.strips = {v: [cv2.dft(plane[v : v + self.size[0]]) for plane in planes] for v in starts}

    def __call__(self, kernels: Floating) -> Floating:
        out = np.empty((len(kernels), self.height, self.width), dtype=kernels.dtype)
        for result, kernel in zip(out, kernels, strict=True):
            spectra = [self._transform(plane) for plane in kernel]
            for v, strip in self.strips.items():
                total = cv2.mulSpectrums(strip[0], spectra[0], 0, conjB=True)
                for plane, spectrum in zip(strip[1:], spectra[1:], strict=True):
                    cv2.add(total, cv2.mulSpectrums(plane, spectrum, 0, conjB=True), dst=total)
                correlation = cv2.idft(total, flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT)
                rows = result[v : v + self.rows]
                rows[:] = correlation[: len(rows), : self.width]
        return out

    def _transform(self, plane: Floating) -> NDArray[Any]:
        field = np.zeros(self.size, dtype=plane.dtype)
        field[: plane.shape[0], : plane.shape[1]] = plane
        # To say how few rows are not empty (nonzeroRows) would keep OpenCV from its fastest transform.
        return cv2.dft(field)
