"""Stereo pairs to load a service with: those of the sample surgery, each with noise of its own."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.imaging.decoding import decode_image
from spinewatch.pipeline import StageRequest
from spinewatch.rig_files.rig_json import parse_rig

SAMPLE = Path(__file__).parents[1] / "samples" / "D1"
STAGES = ("PRE", "INTER", "POST")
_NOISE_SD = 1.0


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
    """Return pairs of the sample's stages in turn, each with noise of its own; no two have the same bytes."""
    rng = np.random.default_rng(seed)
    frames = [
        [decode_image((SAMPLE / stage / f"{side}.png").read_bytes()) for side in ("left", "right")]
        for stage in STAGES
    ]
    return [Pair(*(_noisy(pixels, rng) for pixels in frames[k % len(STAGES)])) for k in range(count)]


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


def _noisy(pixels: Pixels, rng: np.random.Generator) -> bytes:
    values = pixels.astype(np.float32) + rng.normal(0.0, _NOISE_SD, pixels.shape).astype(np.float32)
    buffer = io.BytesIO()
    Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8)).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()
