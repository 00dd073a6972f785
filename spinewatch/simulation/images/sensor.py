"""Sensor model: blur, exposure, noise, gray levels and compression of a simulated image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Single
from spinewatch.simulation.images.draws import log_uniform

_BLOCK = 8
"""Width of the blocks of JPEG, px."""
_DEFOCUSED, _SHAKEN, _COMPRESSED, _SHARPENED = 0.22, 0.12, 0.25, 0.12
"""Fractions of the sensors."""


@dataclass(frozen=True)
class SensorModel:
    """A lens, a sensor, its exposure and what is done with its images.

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
    defocus_px
        Diameters of the disc of defocus in u and v, px; 0 for none.
    motion_px
        Movement during the exposure in u and v, px.
    vignette
        Logarithm of the relative gain at the right and at the lower border, over that in the middle.
    sharpening
        Weight of the difference from the blurred image that is added.
    quality
        JPEG quality; None for no compression.
    """

    blur_px: tuple[float, float]
    level: float
    veil: float
    black: float
    read: float
    shot: float
    response: float
    defocus_px: tuple[float, float] = (0.0, 0.0)
    motion_px: tuple[float, float] = (0.0, 0.0)
    vignette: tuple[float, float] = (0.0, 0.0)
    sharpening: float = 0.0
    quality: int | None = None


def random_sensor(rng: np.random.Generator, ball_px: tuple[float, float]) -> SensorModel:
    """Return a random sensor and exposure, from very dark to overexposed, sharp to blurred.

    Parameters
    ----------
    rng
        Source of random numbers.
    ball_px
        Width and height of a ball, px: large images have a wider blur.

    Returns
    -------
    SensorModel
        The sensor.
    """
    kind = rng.choice(("normal", "dark", "glare", "curved"), p=(0.45, 0.3, 0.1, 0.15))
    low, high = {"normal": (30, 130), "dark": (5, 35), "glare": (120, 350), "curved": (20, 110)}[kind]
    # A downsampled image is sharper and less noisy.
    downsampling = rng.uniform(0.25, 1) if rng.random() < 0.3 else 1.0
    width, height = ball_px
    defocus = log_uniform(rng, 0.08, 0.4) if rng.random() < _DEFOCUSED else 0.0
    motion = log_uniform(rng, 0.05, 0.45) if rng.random() < _SHAKEN else 0.0
    along = rng.uniform(0, np.pi)
    return SensorModel(
        blur_px=(downsampling * rng.uniform(0.4, 0.9), downsampling * rng.uniform(0.4, 0.9)),
        level=float(np.exp(rng.uniform(np.log(low), np.log(high)))),
        veil=rng.uniform(0, 0.08),
        black=rng.uniform(0, 2),
        read=downsampling * rng.uniform(0.4, 1.6) * (log_uniform(rng, 1, 4) if rng.random() < 0.15 else 1),
        shot=downsampling**2 * rng.uniform(0.01, 0.07),
        response=rng.uniform(0.45, 0.9) if kind == "curved" else 1.0,
        defocus_px=(defocus * width, defocus * height),
        motion_px=(motion * width * np.cos(along), motion * height * np.sin(along)),
        vignette=(rng.normal(0, 0.06), rng.normal(0, 0.06)),
        sharpening=rng.uniform(0, 1.2) if rng.random() < _SHARPENED else 0.0,
        quality=int(rng.integers(25, 97)) if rng.random() < _COMPRESSED else None,
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
        Source of random numbers, for the noise and the position of the image among the blocks of JPEG.

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
    for kernel in (_disc(sensor.defocus_px, samples), _line(sensor.motion_px, samples)):
        if kernel.size > 1:
            smooth = cv2.filter2D(smooth, -1, kernel, borderType=cv2.BORDER_REFLECT)
    h, w = (n // samples for n in radiance.shape)
    pixels = cv2.resize(smooth, (w, h), interpolation=cv2.INTER_AREA)
    level = sensor.level * (pixels / median * _gain(sensor.vignette, h, w) + sensor.veil)
    level = level + rng.standard_normal(level.shape, np.float32) * np.sqrt(
        sensor.read**2 + sensor.shot * level
    )
    if sensor.sharpening:
        level += np.float32(sensor.sharpening) * (level - cv2.GaussianBlur(level, (0, 0), 1.0))
    level = np.rint(255 * ((level + sensor.black) / 255).clip(0, 1) ** sensor.response)
    if sensor.quality is not None:
        level = _compressed(level, sensor.quality, rng)
    return np.asarray(level, dtype=np.float32)


def _gain(vignette: tuple[float, float], h: int, w: int) -> Single:
    """Return the relative gain (h, w)."""
    right, low = (
        np.exp(a * np.linspace(-1, 1, n, dtype=np.float32)) for a, n in zip(vignette, (w, h), strict=True)
    )
    return np.asarray(low[:, None] * right)


def _disc(diameters_px: tuple[float, float], samples: int) -> Single:
    """Return the kernel of a disc, or of an ellipse where pixels are not square, with smooth borders."""
    a, b = (diameter * samples / 2 for diameter in diameters_px)
    u, v = _grid(a, b)
    r = np.hypot(u / max(a, 0.5), v / max(b, 0.5))
    return _normalized(((1 - r) * max(min(a, b), 0.5) + 0.5).clip(0, 1))


def _line(motion_px: tuple[float, float], samples: int) -> Single:
    """Return the kernel of a uniform movement, with smooth borders."""
    a, b = (part * samples / 2 for part in motion_px)
    length = np.hypot(a, b)
    u, v = _grid(abs(a), abs(b))
    along = (u * a + v * b) / max(length, 1e-6)
    ends = (length - np.abs(along) + 0.5).clip(0, 1)
    return _normalized(ends * (1 - np.abs(u * b - v * a) / max(length, 1e-6)).clip(0, 1))


def _grid(a: float, b: float) -> tuple[Single, Single]:
    """Return coordinates (u, v) about the middle of a kernel that reaches from -a to a and from -b to b."""
    wide, high = int(np.ceil(a)), int(np.ceil(b))
    u, v = np.meshgrid(np.arange(-wide, wide + 1), np.arange(-high, high + 1))
    return u.astype(np.float32), v.astype(np.float32)


def _normalized(kernel: Single) -> Single:
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


def _compressed(level: Single, quality: int, rng: np.random.Generator) -> Single:
    """Return whole gray levels (h, w) after compression, at a random position among the blocks."""
    (h, w), (top, left) = level.shape, rng.integers(0, _BLOCK, 2)
    low, right = -(top + h) % _BLOCK, -(left + w) % _BLOCK
    whole = cv2.copyMakeBorder(level, int(top), int(low), int(left), int(right), cv2.BORDER_REFLECT_101)
    _, data = cv2.imencode(".jpg", whole.astype(np.uint8), (cv2.IMWRITE_JPEG_QUALITY, quality))
    decoded = np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.float32)
    return decoded[top : top + h, left : left + w]
