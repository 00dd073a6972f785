"""Stereo pairs to load a service with: those of the sample surgery, each with a shift and noise of its own.

With noise alone they would repeat each other, which a service flags after a comparison that no pair of a surgery needs.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from spinewatch.arrays import Float, Pixels
from spinewatch.camera import Rig
from spinewatch.imaging.decoding import decode_image
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.stage import StageRequest

SAMPLE = Path(__file__).parents[1] / "samples" / "D1"
STAGES = ("PRE", "INTER", "POST")
_NOISE_SD = 1.0
_SHIFT_SD_PX = 1.0


@dataclass(frozen=True)
class Pair:
    """The files of a stereo pair, PNG."""

    left: bytes
    right: bytes

    @property
    def size_bytes(self) -> int:
        """Size of both files."""
        return len(self.left) + len(self.right)


def make_pairs(count: int, seed: int) -> list[Pair]:
    """Return pairs of the sample's stages in turn, each with a shift and noise of its own."""
    rng = np.random.default_rng(seed)
    frames = [
        [decode_image((SAMPLE / stage / f"{side}.png").read_bytes()) for side in ("left", "right")]
        for stage in STAGES
    ]
    shifts = rng.normal(0.0, _SHIFT_SD_PX, (count, 2))
    return [
        Pair(*(_changed(pixels, shift, rng) for pixels in frames[k % len(STAGES)]))
        for k, shift in enumerate(shifts)
    ]


def read_rig() -> Rig:
    """Return the rig of the sample."""
    return parse_rig(rig_text())


def rig_text() -> str:
    """Return the rig JSON of the sample."""
    return (SAMPLE / "rig.json").read_text()


def surgery_document(reference: str) -> dict[str, Any]:
    """Return the sample surgery under a case number, as the API takes it."""
    sample = json.loads((SAMPLE / "surgery.json").read_text())
    return {"reference": reference} | {
        key: sample[key] for key in ("vertebrae", "reference_vertebra", "spine_axis")
    }


def spine_document() -> dict[str, Any]:
    """Return the setup of the sample's spine, as the API takes it."""
    document: dict[str, Any] = json.loads((SAMPLE / "spine.json").read_text())
    return document


def stage_request() -> StageRequest:
    """Return what a worker asks the library for."""
    sample = surgery_document("")
    return StageRequest(labels=tuple(sample["vertebrae"]), spine_axis=sample["spine_axis"])


def _changed(pixels: Pixels, shift_px: Float, rng: np.random.Generator) -> bytes:
    """Return an image as after a shake of both cameras, with new noise."""
    move = np.hstack([np.eye(2), shift_px[:, None]])
    moved = cv2.warpAffine(
        pixels.astype(np.float32),
        move,
        pixels.shape[::-1],
        flags=cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_REPLICATE,
    )
    values = moved + rng.normal(0.0, _NOISE_SD, pixels.shape).astype(np.float32)
    buffer = io.BytesIO()
    Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8)).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()
