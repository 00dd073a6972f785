"""The camera's part: blur, exposure, noise and gray levels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Single


@dataclass(frozen=True)
class Sensor:
    """A camera and its exposure; ``blur_px`` (u, v) are standard deviations of the lens, in pixels.

    ``level``: gray level, of 255, of the picture's mean radiance; ``veil``: stray light as a part of the mean;
    ``black``: level of no light; ``read``: noise of reading, in levels; ``shot``: variance of light per level;
    ``response``: exponent of the tone curve.
    """

    blur_px: tuple[float, float]
    level: float
    veil: float
    black: float
    read: float
    shot: float
    response: float


def draw_sensor(rng: np.random.Generator) -> Sensor:
    """Return a sensor and an exposure, from very dark to glare."""
    kind = rng.choice(("normal", "dark", "glare", "curved"), p=(0.45, 0.3, 0.1, 0.15))
    low, high = {"normal": (30, 130), "dark": (5, 35), "glare": (120, 350), "curved": (20, 110)}[kind]
    # A picture that was reduced is sharper and less noisy than one that was not.
    calm = rng.uniform(0.25, 1) if rng.random() < 0.3 else 1.0
    return Sensor(
        blur_px=(calm * rng.uniform(0.4, 0.9), calm * rng.uniform(0.4, 0.9)),
        level=float(np.exp(rng.uniform(np.log(low), np.log(high)))),
        veil=rng.uniform(0, 0.08),
        black=rng.uniform(0, 2),
        read=calm * rng.uniform(0.4, 1.6),
        shot=calm**2 * rng.uniform(0.01, 0.07),
        response=rng.uniform(0.45, 0.9) if kind == "curved" else 1.0,
    )


def expose(radiance: Single, fine: int, sensor: Sensor, rng: np.random.Generator) -> Single:
    """Return whole gray levels (h, w) of 0..255 from radiance (h fine, w fine), ``fine`` samples a pixel each way."""
    su, sv = (float(b) * fine for b in sensor.blur_px)
    mean = float(np.median(radiance))
    smooth = cv2.GaussianBlur(radiance, (0, 0), su, sigmaY=sv, borderType=cv2.BORDER_REFLECT)
    h, w = (n // fine for n in radiance.shape)
    pixels = cv2.resize(smooth, (w, h), interpolation=cv2.INTER_AREA)
    level = sensor.level * (pixels / mean + sensor.veil)
    level = level + rng.standard_normal(level.shape, np.float32) * np.sqrt(
        sensor.read**2 + sensor.shot * level
    )
    level = 255 * ((level + sensor.black) / 255).clip(0, 1) ** sensor.response
    return np.asarray(np.rint(level), dtype=np.float32)
