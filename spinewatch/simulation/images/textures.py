"""Random periodic textures of tissue."""

from __future__ import annotations

import cv2
import numpy as np

from spinewatch.arrays import Floating, Single


def random_textures(rng: np.random.Generator, count: int, size: int) -> Single:
    """Return random textures: noise of a random spectral slope, stretched, some mapped to grains, ridges or cells.

    Parameters
    ----------
    rng
        Source of random numbers.
    count
        Number of textures.
    size
        Width and height, texels.

    Returns
    -------
    Single
        Periodic textures of zero mean and unit variance, shape (count, size, size).

    Examples
    --------
    >>> random_textures(np.random.default_rng(0), 2, 32).shape
    (2, 32, 32)
    """
    fy, fx = np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij")
    out = np.empty((count, size, size), np.float32)
    for texture in out:
        stretch, azimuth = float(np.exp(rng.uniform(0, np.log(3)))), rng.uniform(0, np.pi)
        a, b = fx * np.cos(azimuth) + fy * np.sin(azimuth), fy * np.cos(azimuth) - fx * np.sin(azimuth)
        f = np.hypot(a * stretch, b / stretch)
        low, slope = rng.uniform(0.003, 0.03), rng.uniform(0.7, 1.8)
        amplitude = (f * f + low * low) ** (-slope / 2)

        def noise(amplitude: Floating = amplitude) -> Floating:
            white = rng.standard_normal((size, size))
            field = np.fft.irfft2(np.fft.rfft2(white) * amplitude, (size, size))
            return np.asarray((field - field.mean()) / field.std())

        field = noise()
        kind = rng.integers(5)
        if kind == 1:  # grains
            field = np.tanh(2 * field) + 0.5 * noise()
        elif kind == 2:  # ridges
            field = -np.abs(field) + 0.4 * noise()
        elif kind == 3:  # spots on a uniform ground
            field = np.maximum(field - rng.uniform(0.3, 1.2), 0) * rng.choice((-1, 1)) + 0.3 * noise()
        elif kind == 4:  # lobules of fat
            field = 3 * _cells(rng, size) + 0.4 * field
        texture[:] = (field - field.mean()) / field.std()
    return out


def _cells(rng: np.random.Generator, size: int) -> Floating:
    """Return round cells (size, size) with dark borders between them: 1 minus the scaled distance to a middle."""
    middles = np.ones((size, size), np.uint8)
    count = int(np.exp(rng.uniform(np.log(40), np.log(600))))
    middles.ravel()[rng.integers(0, size * size, count)] = 0
    around = np.pad(middles, size // 4, mode="wrap")
    distance = cv2.distanceTransform(around, cv2.DIST_L2, cv2.DIST_MASK_5)
    inner = distance[size // 4 : size // 4 + size, size // 4 : size // 4 + size]
    return np.asarray(1 - np.square(inner * np.sqrt(count) / size))
