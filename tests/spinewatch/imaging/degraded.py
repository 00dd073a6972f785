"""Images of the sample surgery, as they are and degraded."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from spinewatch.imaging.decoding import decode_image
from tests.paths import SAMPLES

Change = Callable[[NDArray[Any]], NDArray[Any]]


def sample(stage: str = "PRE", side: str = "left") -> NDArray[np.float32]:
    return decode_image((SAMPLES / "D1" / stage / f"{side}.png").read_bytes()).astype(np.float32)


def whole(image: NDArray[Any]) -> NDArray[np.uint8]:
    levels: NDArray[np.uint8] = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return levels


def jpeg(quality: int) -> Change:
    def change(image: NDArray[Any]) -> NDArray[Any]:
        buffer = BytesIO()
        Image.fromarray(whole(image)).save(buffer, "JPEG", quality=quality)
        return np.asarray(Image.open(buffer))

    return change


def fields_apart(shift: int) -> Change:
    def change(image: NDArray[Any]) -> NDArray[Any]:
        woven = image.copy()
        woven[1::2] = np.roll(image[1::2], shift, axis=1)
        return woven

    return change


def banded(image: NDArray[Any]) -> NDArray[Any]:
    rows = np.arange(len(image))[:, None]
    return image * (1 + 0.5 * np.sin(rows / 13)) / 1.5


def noisy(image: NDArray[Any]) -> NDArray[Any]:
    return image + np.random.default_rng(1).normal(0, 12, image.shape)


def lost(image: NDArray[Any]) -> NDArray[Any]:
    broken = image.copy()
    broken[200:216, 120:440] = 128
    return broken


def jumping(image: NDArray[Any]) -> NDArray[Any]:
    """Return a JPEG whose decoder lost its place at block (20, 30)."""
    broken = image.copy()
    broken[160:168, 240:] += 30
    broken[168:] += 30
    return jpeg(92)(broken)
