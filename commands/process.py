"""``spinewatch process``: measure one stereo pair with the library alone and print JSON."""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Annotated, Literal

import typer

from spinewatch.errors import ParameterError, SpinewatchError

SpineAxis = Literal["x", "y", "auto"]


class OutputError(SpinewatchError):
    """The result cannot be written where the user asked."""

    code = "unwritable-file"


def process(
    left: Annotated[Path, typer.Argument(help="Left picture: PNG, TIFF, JPEG or Sun raster.")],
    right: Annotated[Path, typer.Argument(help="Right picture of the same moment.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON: the calibration of both cameras.")],
    triads: Annotated[int | None, typer.Option(help="How many triads were placed.")] = None,
    labels: Annotated[
        str | None, typer.Option(help="Vertebrae by increasing coordinate along the spine: L1,T11,T9,T7.")
    ] = None,
    spine_axis: Annotated[
        SpineAxis, typer.Option(help="Object-space axis along which the spine lies.")
    ] = "auto",
    out: Annotated[Path | None, typer.Option(help="Write the JSON here instead of to stdout.")] = None,
) -> None:
    """Measure one stereo pair without a server: features, labelled triads, flags and timings as JSON."""
    names = label_names(labels, triads)
    from commands.shared.pair import measure_pair  # noqa: PLC0415 - loads OpenCV and SciPy, which --help can do without

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # stderr carries one line, the error's
        document = measure_pair(left, right, rig, names, spine_axis, len(names) or triads)
    text = json.dumps(document, indent=2) + "\n"
    if out is None:
        sys.stdout.write(text)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {out}: {error.strerror}") from error


def label_names(labels: str | None, triads: int | None) -> tuple[str, ...]:
    """Return the names in a comma-separated list; raise ``ParameterError`` unless they suit ``triads``."""
    if triads is not None and triads < 1:
        raise ParameterError(f"--triads is {triads}; give the number of triads placed, 1 or more")
    if labels is None:
        return ()
    names = tuple(name.strip() for name in labels.split(","))
    if not all(names):
        raise ParameterError(f"--labels {labels!r} has an empty name; write them like L1,T11,T9,T7")
    if len(set(names)) < len(names):
        raise ParameterError(f"--labels {labels!r} names a vertebra twice; name each once")
    if triads is not None and len(names) != triads:
        raise ParameterError(f"--labels has {len(names)} names but --triads is {triads}; make them agree")
    return names
