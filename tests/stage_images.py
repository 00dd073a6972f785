"""Images of the sample surgery, changed: with other noise, or with a triad hidden."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
from PIL import Image

from spinewatch.arrays import Float
from tests.paths import SAMPLES

Pair = tuple[bytes, bytes]
Box = tuple[int, int, int, int]
Change = Callable[[Float, int], Float]

T7_IN_INTER: tuple[Box, Box] = ((362, 197, 412, 243), (317, 201, 374, 249))
"""Where both images of stage INTER show the triad of T7: u0, v0, u1, v1, px."""


def sample(stage: str) -> Pair:
    """Return the images of a stage of the sample surgery."""
    return _read(stage, "left"), _read(stage, "right")


def with_noise(pair: Pair, seed: int) -> Pair:
    """Return a pair with other noise, of one gray level, as another exposure of the same scene has."""
    random = np.random.default_rng(seed)
    return _changed(pair, lambda pixels, _: pixels + random.normal(0, 1, pixels.shape))


def without(pair: Pair, boxes: tuple[Box, Box]) -> Pair:
    """Return a pair with a part of each image painted over."""
    random = np.random.default_rng(0)

    def paint(pixels: Float, index: int) -> Float:
        u0, v0, u1, v1 = boxes[index]
        pixels[v0:v1, u0:u1] = np.median(pixels) + random.normal(0, 2, (v1 - v0, u1 - u0))
        return pixels

    return _changed(pair, paint)


def _read(stage: str, side: str) -> bytes:
    return (SAMPLES / "D1" / stage / f"{side}.png").read_bytes()


def _changed(pair: Pair, change: Change) -> Pair:
    left, right = (_one(content, change, index) for index, content in enumerate(pair))
    return left, right


def _one(content: bytes, change: Change, index: int) -> bytes:
    pixels = np.asarray(Image.open(io.BytesIO(content)).convert("L")).astype(np.float64)
    out = io.BytesIO()
    Image.fromarray(np.clip(np.rint(change(pixels, index)), 0, 255).astype(np.uint8)).save(out, "PNG")
    return out.getvalue()
