"""``spinewatch spine``: the spine at every stage from files, as the service computes it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.files import write_text
from commands.shared.labels import parse_extra_levels


def spine(
    setup: Annotated[
        Path, typer.Argument(help="Setup of the spine: JSON as for PUT /v1/surgeries/ID/spine.")
    ],
    stages: Annotated[
        list[str],
        typer.Argument(
            help="Stages in their order, STAGE=RESULT.json of `spinewatch process`;"
            " STAGE=RESULT.json,LEFT,RIGHT adds the images' hashes for a report."
        ),
    ],
    reference: Annotated[
        str | None,
        typer.Option(help="Vertebra of the reference triad.", show_default="that of the setup"),
    ] = None,
    extra_levels: Annotated[
        str | None, typer.Option(help="Vertebrae that this spine has in addition to the usual ones: T13,L6.")
    ] = None,
    radiograph: Annotated[
        list[Path] | None,
        typer.Option(
            help="JSON of a radiograph that the setup names, as GET /v1/surgeries/ID/radiographs/ID shows it;"
            " once per view."
        ),
    ] = None,
    tables: Annotated[bool, typer.Option("--tables", help="Print tables instead of JSON.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="File to write the JSON to.", show_default="standard output")
    ] = None,
) -> None:
    """Compute vertebrae, measures and changes of every stage; print the summary of the surgery as JSON.

    `spinewatch report` and `spinewatch export` read the JSON.
    """
    extra = parse_extra_levels(extra_levels)
    from commands.shared.spine_files import parse_stages, read_radiographs, summarize  # noqa: PLC0415 - loads SciPy
    from commands.shared.spine_tables import print_measures  # noqa: PLC0415
    from commands.shared.surgery_tables import print_note  # noqa: PLC0415

    views = read_radiographs(radiograph or [])
    summary = summarize(setup, parse_stages(stages), reference, extra, views)
    if out is not None:
        write_text(out, summary.model_dump_json(indent=2) + "\n")
    if tables:
        print_measures([stage.spine for stage in summary.stages if stage.spine is not None])
        for stage in summary.stages:
            reasons = [flag.detail for flag in stage.flags or ()]
            reasons += (
                [stage.spine_reason or ""] if stage.spine is None else [f.detail for f in stage.spine.flags]
            )
            for reason in reasons:
                print_note(f"{stage.name}: {reason}")
    elif out is None:
        sys.stdout.write(summary.model_dump_json(indent=2) + "\n")
