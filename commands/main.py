"""The ``spinewatch`` command: registers the commands and reports named errors."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from commands import (
    audit,
    backup,
    calibrate,
    convert,
    db,
    disparity,
    export,
    field,
    igtl,
    key,
    plan,
    process,
    purge,
    report,
    restore,
    run,
    sample,
    sbom,
    serve,
    simulate,
    spine,
    templates,
    verify,
    worker,
)
from commands.programs_1995 import detect, match, ndlt, pix2mm, sim3d, spaco, v2stereo
from spinewatch.errors import SpinewatchError


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415 - most commands do not need it

        typer.echo(f"spinewatch {version('spinewatch')}")
        raise typer.Exit


cli = typer.Typer(
    name="spinewatch",
    help="Measure the spine from stereo pairs of triad markers.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@cli.callback()
def _spinewatch(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version and exit.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    pass


cli.command("process")(process.process)
cli.command("calibrate")(calibrate.calibrate)
cli.command("convert")(convert.convert)
cli.command("serve")(serve.serve)
cli.command("worker")(worker.worker)
cli.command("run")(run.run)
cli.command("sample")(sample.sample)
cli.command("simulate")(simulate.simulate)
cli.command("plan")(plan.plan)
cli.command("spine")(spine.spine)
cli.command("report")(report.report)
cli.command("export")(export.export)
cli.command("sbom")(sbom.sbom)
cli.command("igtl")(igtl.igtl)
cli.command("disparity")(disparity.disparity)
cli.command("backup")(backup.backup)
cli.command("verify")(verify.verify)
cli.command("restore")(restore.restore)
cli.command("purge")(purge.purge)
cli.command("pix2mm")(pix2mm.pix2mm)
cli.command("ndlt")(ndlt.ndlt)
cli.command("v2stereo")(v2stereo.v2stereo)
cli.command("sim3d")(sim3d.sim3d)
cli.command("detect")(detect.detect)
cli.command("match")(match.match)
cli.command("spaco")(spaco.spaco)
cli.add_typer(field.cli, name="field")
cli.add_typer(db.cli, name="db")
cli.add_typer(audit.cli, name="audit")
cli.add_typer(key.cli, name="key")
cli.add_typer(templates.cli, name="templates")


def app() -> None:
    """Run the command line; a ``SpinewatchError`` becomes one line on stderr and exit status 2."""
    try:
        cli()
    except SpinewatchError as error:
        print(f"spinewatch: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
