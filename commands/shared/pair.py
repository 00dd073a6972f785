"""Measurement of one stereo pair from files."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from commands.shared.explanation import write_explanation
from commands.shared.files import read_image
from commands.shared.methods import MethodOptions, Prepare, prepare_default
from commands.shared.rig import read_rig
from commands.shared.stopwatch import Stopwatch
from contract.stage import StageResult
from spinewatch.arrays import Pixels
from spinewatch.errors import ImageError, ImageSizeError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.header import inspect_image
from spinewatch.stage import StageRequest

_LAST = ("parameters", "features")
"""Long parts of a stage document, printed after the rest."""


def measure_pair(
    left: Path,
    right: Path,
    rig_path: Path,
    request: StageRequest,
    options: MethodOptions | None = None,
    explain: Path | None = None,
    prepare: Prepare = prepare_default,
) -> dict[str, Any]:
    """Return the stage document of two image files, with ``timings_ms`` per step and in total.

    ``prepare`` makes the method ready. With a folder ``explain`` its steps and the candidates are written there.
    Raises a ``SpinewatchError`` that names the file and what is wrong with it.
    """
    rig = read_rig(rig_path)
    left_bytes, right_bytes = read_image(left), read_image(right)
    if left_bytes == right_bytes:
        raise SameImageError(f"{left} and {right} are the same image; give the left and the right one")
    clock = Stopwatch()
    clock("decode")
    frames = (
        Frame(decode_file(left, left_bytes, rig.left.image_size_px), "left"),
        Frame(decode_file(right, right_bytes, rig.right.image_size_px), "right"),
    )
    clock("prepare")
    with ThreadPoolExecutor(max_workers=1) as pool:
        method = prepare(rig, options or MethodOptions(), pool)
        measurement = method.measurer.measure(*frames, request, clock, explained=explain is not None)
        timings = clock.stop()
        if explain is not None:
            write_explanation(explain, method, frames, request, measurement)
    result = StageResult.of(measurement, version("spinewatch"))
    document = result.model_dump(mode="json")
    long = {name: document.pop(name) for name in _LAST}
    return {**document, "timings_ms": timings, **long}


def decode_file(path: Path, data: bytes, calibrated_px: tuple[int, int]) -> Pixels:
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
