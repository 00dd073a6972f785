"""Bands of brightness over the height of an image, which lamps that flicker leave in rows exposed one after another."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.imaging.level_differences import Bytes

_MIN_PERIOD_PX = 8
"""Least height of a band, in rows."""


def bands(levels: Bytes, n_strips: int, min_cycles: int) -> tuple[float, float, int]:
    """Return the strongest periodic band of brightness that is the same over the whole width.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.
    n_strips
        Number of parts of the width that are compared.
    min_cycles
        Least number of bands over the height.

    Returns
    -------
    amplitude : float
        Amplitude as a fraction of the brightness.
    ratio : float
        Amplitude over its standard error, from the differences between strips.
    cycles : int
        Number of bands over the height.
    """
    height = len(levels)
    parts = np.array_split(levels, n_strips, axis=1)
    means = [cv2.reduce(part, 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel() for part in parts]
    strips = np.log(np.stack(means).astype(np.float64) + 4)
    curves, window = _trends_and_window(height)
    strips -= strips @ curves.T @ curves
    waves = np.fft.rfft(strips * window, axis=1)[:, min_cycles : height // _MIN_PERIOD_PX] * (
        2 / window.sum()
    )
    common = waves.mean(axis=0)
    error = np.sqrt((np.abs(waves - common) ** 2).sum(axis=0) / (n_strips * (n_strips - 1))) + 1e-9
    best = int((np.abs(common) - 2 * error).argmax())
    return float(np.abs(common[best])), float(np.abs(common[best]) / error[best]), best + min_cycles


@lru_cache(maxsize=8)
def _trends_and_window(height: int) -> tuple[Float, Float]:
    """Return orthonormal curves (4, H) of the polynomials to the third degree, and a window (H,), for H rows."""
    curves, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, height), 3))
    return np.asarray(curves.T), np.hanning(height)
