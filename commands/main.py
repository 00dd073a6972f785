"""The ``spinewatch`` command: registers the commands and reports named errors."""

from __future__ import annotations

import sys
from typing import Annotated, NoReturn

import typer
from typer.exceptions import TyperException

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
from commands.shared.output import standard_output
from exports.text import single_line
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
    """Run the command line; a named error, or wrong arguments, become one line on stderr and exit status 2."""
    try:
        with standard_output():
            status = cli(standalone_mode=False)
    except SpinewatchError as error:
        _end(str(error), 2)
    except TyperException as error:
        _end(_wrong_arguments(error), 2)
    except typer.Abort:
        _end("ended without an answer", 1)
    except BrokenPipeError:  # whoever read the output has ended, and wants no more
        sys.exit(1)
    sys.exit(status)


def _wrong_arguments(error: TyperException) -> str:
    """Return what is wrong with the arguments in one line; nothing if there are none, when the help is printed."""
    if type(error).__name__ == "NoArgsIsHelpError":
        return ""
    context = getattr(error, "ctx", None)
    command = "spinewatch" if context is None else context.command_path
    problem = " ".join(error.format_message().split()).removesuffix(".")
    option = getattr(error, "param", None)
    low, high = getattr(option, "min", None), getattr(option, "max", None)
    if isinstance(error, typer.BadParameter) and low is not None and high is not None:
        problem += f"; give {low:.12g} to {high:.12g}"
    return f"{problem}; see {command} --help"


def _end(line: str, status: int) -> NoReturn:
    """Print why the command ends, in one line whatever names of files and documents say, and end it."""
    if line:
        print(f"spinewatch: {single_line(line)}", file=sys.stderr)  # noqa: T201
    sys.exit(status)
