"""``spinewatch process``: measure one stereo pair without a service and print JSON."""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from commands.shared.files import write_text
from commands.shared.labels import parse_extra_levels, parse_labels

if TYPE_CHECKING:
    from commands.shared.methods import Prepare

SpineAxis = Literal["x", "y", "auto"]
MethodName = Literal["default", "thesis-1995"]
SizeReduction = Literal["sd", "mean", "none"]


def process(  # noqa: PLR0913, PLR0917 - one argument per option
    left: Annotated[Path, typer.Argument(help="Left image: PNG, TIFF, JPEG or Sun raster.")],
    right: Annotated[Path, typer.Argument(help="Right image, taken at the same time.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON: calibration of both cameras.")],
    triads: Annotated[
        int | None, typer.Option(min=1, max=30, help="Number of triads in the field of view.")
    ] = None,
    labels: Annotated[
        str | None,
        typer.Option(
            help="Marked vertebrae in order of increasing coordinate along the spine: L1,T11,T9,T7."
        ),
    ] = None,
    extra_levels: Annotated[
        str | None,
        typer.Option(
            help="Vertebrae that this spine has in addition to C1-C7, T1-T12, L1-L5 and S1: T13,L6."
        ),
    ] = None,
    spine_axis: Annotated[SpineAxis, typer.Option(help="Object-space axis along the spine.")] = "auto",
    range_mm: Annotated[
        str | None,
        typer.Option(
            "--range",
            help="Nearest and farthest range of the markers along the optical axes, mm: 630,760. Required when the"
            " axes are parallel.",
            show_default="from the rig",
        ),
    ] = None,
    markers: Annotated[
        list[str] | None,
        typer.Option(
            "--marker",
            help="Marker in use, once per kind: a name, flat:XX,YY,MX or orthogonal:XX,YY,ZZ with the lengths of its"
            " legs from P to the centres of the balls, mm. The order matters: flat:18,14,10 is flat-10-14-18, whose"
            " name begins with the shortest leg.",
            show_default="flat-10-14-18",
        ),
    ] = None,
    method: Annotated[
        MethodName, typer.Option(help="Method of measurement: the default one, or that of the 1995 thesis.")
    ] = "default",
    refine: Annotated[
        bool | None,
        typer.Option(
            "--refine/--no-refine",
            help="Discard candidates whose surroundings are unlike (eq. 5.11).",
            show_default="no; yes with thesis-1995",
        ),
    ] = None,
    size_reduction: Annotated[
        SizeReduction | None,
        typer.Option(
            help="Statistic of the rows by which thesis-1995 finds the surgical field; none searches the image.",
            show_default="sd with thesis-1995",
        ),
    ] = None,
    earlier: Annotated[
        Path | None,
        typer.Option(
            help="JSON of an earlier stage, whose distances decide on labels when triads are missing (H4)."
        ),
    ] = None,
    templates: Annotated[
        Path | None,
        typer.Option(
            help="Template set from `spinewatch templates build`, or build-1995 with thesis-1995.",
            show_default="the built-in one",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write the JSON to.", show_default="standard output")
    ] = None,
    explain: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for images of each step and the candidates with what rejected them."
        ),
    ] = None,
) -> None:
    """Measure one stereo pair: features, labelled triads, flags and timings as JSON."""
    extra = parse_extra_levels(extra_levels)
    names = parse_labels(labels, triads, extra)
    from commands.shared.measuring_options import (  # noqa: PLC0415 - as below
        parse_markers,
        parse_range,
        read_earlier_stage,
    )
    from commands.shared.methods import MethodOptions  # noqa: PLC0415 - as below
    from commands.shared.pair import measure_pair  # noqa: PLC0415 - loads OpenCV and SciPy, which --help does not need
    from spinewatch.stage import StageRequest  # noqa: PLC0415 - as above

    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # decoders warn on stderr, which is reserved for the one line of an error
        known = None if earlier is None else read_earlier_stage(earlier)
        models = parse_markers(markers or ())
        request = StageRequest(names, spine_axis, len(names) or triads, models, known, extra)
        options = MethodOptions(parse_range(range_mm), refine, templates, size_reduction)
        document = measure_pair(left, right, rig, request, options, explain, _prepare(method))
    text = json.dumps(document, indent=2) + "\n"
    if out is None:
        sys.stdout.write(text)
    else:
        write_text(out, text)


def _prepare(method: MethodName) -> Prepare:
    """Return what makes a method ready for a rig."""
    if method == "thesis-1995":
        from commands.programs_1995.method import prepare_published  # noqa: PLC0415 - as above

        return prepare_published
    from commands.shared.methods import prepare_default  # noqa: PLC0415 - as above

    return prepare_default
