"""The ``spinewatch`` command: registers the commands and reports named errors."""

from __future__ import annotations

import sys

import typer

from commands import (
    calibrate,
    convert,
    db,
    disparity,
    field,
    plan,
    process,
    run,
    sample,
    serve,
    simulate,
    templates,
    worker,
)
from spinewatch.errors import SpinewatchError

cli = typer.Typer(
    name="spinewatch",
    help="Measure the spine from stereo pairs of triad markers.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
cli.command("process")(process.process)
cli.command("calibrate")(calibrate.calibrate)
cli.command("convert")(convert.convert)
cli.command("serve")(serve.serve)
cli.command("worker")(worker.worker)
cli.command("run")(run.run)
cli.command("sample")(sample.sample)
cli.command("simulate")(simulate.simulate)
cli.command("plan")(plan.plan)
cli.command("disparity")(disparity.disparity)
cli.add_typer(field.cli, name="field")
cli.add_typer(db.cli, name="db")
cli.add_typer(templates.cli, name="templates")


def app() -> None:
    """Run the command line; a ``SpinewatchError`` becomes one line on stderr and exit status 2."""
    try:
        cli()
    except SpinewatchError as error:
        print(f"spinewatch: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
