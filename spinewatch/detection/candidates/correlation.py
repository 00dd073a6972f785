"""Similarity of templates with an image at each pixel by Fourier transforms.

References
----------
Thesis appendix A.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Floating
from spinewatch.detection.candidates.similarity import (
    Measure,
    Templates,
    extend_by_reflection,
    normalize_product,
)

_STRIP = 6
"""Height of the strips of an image that are transformed together, in heights of the kernel."""


def similarity(image: Floating, templates: Templates, measure: Measure) -> Floating:
    """Return the similarity of templates at each pixel of an image.

    Equal to `similarity_spatial` except for rounding. The precision of the image (float32 or float64) is kept.

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

    References
    ----------
    Thesis appendix A: with a mean-free template the mean of the window drops out of the numerator, and the energy of
    the windows is the correlation of the squared image with the mask.

    Examples
    --------
    >>> image = np.random.default_rng(0).uniform(0, 255, (1, 20, 30))
    >>> template = Templates(image[None, :, 5:12, 8:15], np.ones((7, 7)))
    >>> rho = similarity(image, template, Measure.RHO)[0]
    >>> tuple(int(i) for i in np.unravel_index(rho.argmax(), rho.shape))
    (8, 11)
    >>> round(float(rho.max()), 6)
    1.0
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
    return normalize_product(product, energy, own, int(pixels) * len(image))


class _Correlator:
    """Correlates one image (C, H, W) with several kernels; transforms it once, in strips that fit the cache.

    OpenCV's transform takes half the time of SciPy's for such sizes.
    """

    def __init__(self, image: Floating, kernel: tuple[int, ...]) -> None:
        (self.height, self.width), (high, wide) = image.shape[1:], kernel
        rows = min(_STRIP * high, self.height)
        # Wrap-around affects only the margin that is cut off, so the size of a strip with its margin is enough.
        self.size = cv2.getOptimalDFTSize(rows + high - 1), cv2.getOptimalDFTSize(self.width + wide - 1)
        self.rows = self.size[0] - high + 1
        first_rows = range(0, self.height, self.rows)
        whole = (first_rows[-1] + self.size[0], self.size[1])
        planes = [extend_by_reflection(plane, (high // 2, wide // 2), whole) for plane in image]
        self.strips = {v: [cv2.dft(plane[v : v + self.size[0]]) for plane in planes] for v in first_rows}

    def __call__(self, kernels: Floating) -> Floating:
        """Return the correlation (n, H, W) with kernels (n, C, h, w)."""
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
        """Return the spectrum of a kernel's plane (h, w), zero beyond it."""
        field = np.zeros(self.size, dtype=plane.dtype)
        field[: plane.shape[0], : plane.shape[1]] = plane
        # With the number of non-zero rows given (nonzeroRows) OpenCV does not use its fastest transform.
        return cv2.dft(field)
