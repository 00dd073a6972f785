"""Measurement of one stereo pair from files."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from commands.shared.files import read_bytes
from commands.shared.rig import read_rig
from commands.shared.stopwatch import Stopwatch
from contract.stage import StageResult
from spinewatch.arrays import Pixels
from spinewatch.detection.candidates.templates import (
    TemplateError,
    TemplateSet,
    default_template_set,
    read_template_set,
)
from spinewatch.errors import ImageError, ImageSizeError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.header import inspect_image
from spinewatch.pipeline import StageMeasurer, StageRequest

_LAST = ("parameters", "features")
"""Long parts of a stage document, printed after the rest."""


def measure_pair(
    left: Path,
    right: Path,
    rig_path: Path,
    labels: tuple[str, ...],
    spine_axis: Literal["x", "y", "auto"],
    triads: int | None,
    templates_path: Path | None = None,
    extra_levels: tuple[str, ...] = (),
) -> dict[str, Any]:
    """Return the stage document of two image files, with ``timings_ms`` per step and in total.

    Raises a ``SpinewatchError`` that names the file and what is wrong with it.
    """
    rig = read_rig(rig_path)
    templates = _templates(templates_path)
    left_bytes, right_bytes = read_bytes(left), read_bytes(right)
    if left_bytes == right_bytes:
        raise SameImageError(f"{left} and {right} are the same image; give the left and the right one")
    clock = Stopwatch()
    clock("decode")
    frames = (
        Frame(_image(left, left_bytes, rig.left.image_size_px), "left"),
        Frame(_image(right, right_bytes, rig.right.image_size_px), "right"),
    )
    request = StageRequest(labels=labels, spine_axis=spine_axis, triads=triads, extra_levels=extra_levels)
    clock("prepare")
    with ThreadPoolExecutor(max_workers=1) as pool:
        measurement = StageMeasurer(rig, templates=templates, pool=pool).measure(*frames, request, clock)
    timings = clock.stop()
    result = StageResult.of(measurement, version("spinewatch"))
    document = result.model_dump(mode="json")
    long = {name: document.pop(name) for name in _LAST}
    return {**document, "timings_ms": timings, **long}


def _templates(path: Path | None) -> TemplateSet:
    if path is None:
        return default_template_set()
    try:
        return read_template_set(read_bytes(path))
    except TemplateError as error:
        raise TemplateError(f"{path}: {error}") from error


def _image(path: Path, data: bytes, calibrated_px: tuple[int, int]) -> Pixels:
    """Return the image in a file, (H, W); its size is checked before it is decoded."""
    try:
        size = inspect_image(data).size
        if size == calibrated_px:
            return decode_image(data)
    except ImageError as error:
        raise ImageError(f"{path}: {error}") from error
    raise ImageSizeError(
        f"{path} is {size[0]} x {size[1]} px, but its camera is calibrated for"
        f" {calibrated_px[0]} x {calibrated_px[1]} px; give the rig of the cameras that took the images"
    )
