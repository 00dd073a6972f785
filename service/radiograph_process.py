"""Radiographs are decoded in a process of its own with limits, so that no file can hold or end the server.

The process reads the file and answers with a line of JSON and the PNG.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import IO, Any

from service.limited_process import NoAnswerError, ProcessLimits, TooCostlyError, answer_of, serve
from spinewatch.errors import ImageError
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.imaging.radiograph_image import RadiographImage, read_radiograph
from spinewatch.imaging.stated_view import StatedView

MAX_CPU_SECONDS = 20
"""CPU time for a radiograph; the largest ones, of noise, take 6 s."""
MAX_MEMORY_BYTES = 1 << 30
"""Address space for a radiograph; the largest ones take half of it."""
MAX_SECONDS = 120.0
"""Time for a radiograph, however busy the machine."""
RADIOGRAPH_LIMITS = ProcessLimits(MAX_CPU_SECONDS, MAX_MEMORY_BYTES, MAX_SECONDS)
"""What a radiograph may take."""


class RadiographTooCostlyError(ImageError):
    """A radiograph takes more time or memory to decode than it may."""

    code = "radiograph-too-costly"


def read_apart(file: IO[bytes], limits: ProcessLimits = RADIOGRAPH_LIMITS) -> RadiographImage:
    """Return a radiograph without the metadata of its file, decoded in a process of its own.

    Parameters
    ----------
    file
        The file: one that has a descriptor, or gets one when it is asked for it.
    limits
        What the process may take.

    Returns
    -------
    RadiographImage
        Gray levels, pixel spacing, and what the file says of its view.

    Raises
    ------
    ImageError
        The file is no radiograph, with the code of the reason.
    RadiographTooCostlyError
        The file takes more time or memory than it may.
    HTTPException
        503 when the machine is too busy or short of memory, 507 without room for the file.
    """
    try:
        with answer_of("service.radiograph_process", [], file, limits) as answer:
            return _result(answer)
    except TooCostlyError as error:
        raise RadiographTooCostlyError(
            "the image takes too much time or memory to decode; export it smaller, or as an uncompressed DICOM file"
        ) from error
    except NoAnswerError as error:
        raise ImageError("the image cannot be decoded; export it again, for example as PNG") from error


def _result(answer: IO[bytes]) -> RadiographImage:
    """Return what the process answered; raises ``ImageError`` if that is why there is no result."""
    found: dict[str, Any] = json.loads(answer.readline())
    if "code" in found:
        error = ImageError(found["detail"])
        error.code = found["code"]
        raise error
    spacing, source = found["pixel_spacing_mm"], found["spacing_source"]
    return RadiographImage(
        answer.read(),
        found["width"],
        found["height"],
        None if spacing is None else (spacing[0], spacing[1]),
        None if source is None else SpacingSource(source),
        StatedView(**found["stated_view"]),
    )


def _answer(data: bytes, _arguments: Sequence[str]) -> Iterator[bytes]:
    """Return what the process answers: a line of JSON and the PNG, or the reason why there is none."""
    try:
        found = read_radiograph(data)
    except ImageError as error:
        yield json.dumps({"code": error.code, "detail": str(error)}).encode() + b"\n"
        return
    document = {
        "width": found.width,
        "height": found.height,
        "pixel_spacing_mm": found.pixel_spacing_mm,
        "spacing_source": found.spacing_source,
        "stated_view": asdict(found.stated_view),
    }
    yield json.dumps(document).encode() + b"\n"
    yield found.png


if __name__ == "__main__":
    serve(_answer)
