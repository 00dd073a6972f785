"""Sensor model: blur, exposure, noise and gray levels of a simulated image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Single


@dataclass(frozen=True)
class SensorModel:
    """A lens, a sensor and its exposure.

    Attributes
    ----------
    blur_px
        Standard deviations of the blur in u and v, px.
    level
        Gray level of the median radiance, of 255.
    veil
        Stray light as a fraction of the median radiance.
    black
        Gray level without light.
    read
        Standard deviation of the read noise, gray levels.
    shot
        Variance of the shot noise per gray level.
    response
        Exponent of the tone curve.
    """

    blur_px: tuple[float, float]
    level: float
    veil: float
    black: float
    read: float
    shot: float
    response: float


def random_sensor(rng: np.random.Generator) -> SensorModel:
    """Return a random sensor and exposure, from very dark to overexposed.

    Parameters
    ----------
    rng
        Source of random numbers.

    Returns
    -------
    SensorModel
        The sensor.
    """
    kind = rng.choice(("normal", "dark", "glare", "curved"), p=(0.45, 0.3, 0.1, 0.15))
    low, high = {"normal": (30, 130), "dark": (5, 35), "glare": (120, 350), "curved": (20, 110)}[kind]
    # A downsampled image is sharper and less noisy.
    downsampling = rng.uniform(0.25, 1) if rng.random() < 0.3 else 1.0
    return SensorModel(
        blur_px=(downsampling * rng.uniform(0.4, 0.9), downsampling * rng.uniform(0.4, 0.9)),
        level=float(np.exp(rng.uniform(np.log(low), np.log(high)))),
        veil=rng.uniform(0, 0.08),
        black=rng.uniform(0, 2),
        read=downsampling * rng.uniform(0.4, 1.6),
        shot=downsampling**2 * rng.uniform(0.01, 0.07),
        response=rng.uniform(0.45, 0.9) if kind == "curved" else 1.0,
    )


def expose(radiance: Single, samples: int, sensor: SensorModel, rng: np.random.Generator) -> Single:
    """Return the gray levels of an image.

    Parameters
    ----------
    radiance
        Radiance, shape (h * samples, w * samples).
    samples
        Samples of the radiance per pixel and axis.
    sensor
        The sensor.
    rng
        Source of random numbers, for the noise.

    Returns
    -------
    Single
        Whole gray levels from 0 to 255, shape (h, w).

    References
    ----------
    EMVA Standard 1288: noise variance linear in the gray level.

    Examples
    --------
    >>> sensor = SensorModel((0.5, 0.5), level=100.0, veil=0.0, black=0.0, read=0.0, shot=0.0, response=1.0)
    >>> expose(np.ones((8, 8), np.float32), 4, sensor, np.random.default_rng(0))
    array([[100., 100.],
           [100., 100.]], dtype=float32)
    """
    su, sv = (float(b) * samples for b in sensor.blur_px)
    median = float(np.median(radiance))
    smooth = cv2.GaussianBlur(radiance, (0, 0), su, sigmaY=sv, borderType=cv2.BORDER_REFLECT)
    h, w = (n // samples for n in radiance.shape)
    pixels = cv2.resize(smooth, (w, h), interpolation=cv2.INTER_AREA)
    level = sensor.level * (pixels / median + sensor.veil)
    level = level + rng.standard_normal(level.shape, np.float32) * np.sqrt(
        sensor.read**2 + sensor.shot * level
    )
    level = 255 * ((level + sensor.black) / 255).clip(0, 1) ** sensor.response
    return np.asarray(np.rint(level), dtype=np.float32)
