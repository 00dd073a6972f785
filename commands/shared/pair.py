"""One stereo pair from files to a JSON document, with every doubt about the files named."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from commands.shared.stopwatch import Stopwatch
from contract.stage_documents import stage_document
from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.errors import ImageError, ImageSizeError, RigError, SameImageError, SpinewatchError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.header import inspect_image
from spinewatch.pipeline import StageRequest, measure_stage
from spinewatch.rig_files.rig_json import parse_rig


class InputError(SpinewatchError):
    """A file that the user named cannot be read."""

    code = "unreadable-file"


def measure_pair(
    left: Path,
    right: Path,
    rig_path: Path,
    labels: tuple[str, ...],
    spine_axis: Literal["x", "y", "auto"],
    triads: int | None,
) -> dict[str, Any]:
    """Return the stage document of two picture files, with ``timings_ms`` a step and in total.

    Raises a ``SpinewatchError`` that names the file and what is wrong with it.
    """
    rig = read_rig(rig_path)
    left_bytes, right_bytes = _read(left), _read(right)
    if left_bytes == right_bytes:
        raise SameImageError(f"{left} and {right} are the same picture; give the left and the right one")
    clock = Stopwatch()
    clock("decode")
    pair = (
        _picture(left, left_bytes, rig.left.image_size_px),
        _picture(right, right_bytes, rig.right.image_size_px),
    )
    request = StageRequest(labels=labels, spine_axis=spine_axis, triads=triads)
    measurement = measure_stage(*pair, rig, request, progress=clock)
    timings = clock.stop()
    return {**stage_document(measurement), "timings_ms": timings}


def read_rig(path: Path) -> Rig:
    """Return the rig in a file; raise a ``SpinewatchError`` that names the file and what is wrong."""
    try:
        return parse_rig(_read(path))
    except RigError as error:
        raise RigError(error.field, f"of {path} {error.problem}") from error


def _picture(path: Path, data: bytes, calibrated: tuple[int, int]) -> Pixels:
    try:
        size = inspect_image(data).size
        if size == calibrated:
            return decode_image(data)
    except ImageError as error:
        raise ImageError(f"{path}: {error}") from error
    raise ImageSizeError(
        f"{path} is {size[0]} x {size[1]} px, but the rig's camera is calibrated for"
        f" {calibrated[0]} x {calibrated[1]} px; give a picture and a rig that belong together"
    )


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
