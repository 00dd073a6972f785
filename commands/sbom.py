"""``spinewatch sbom``: software bill of materials, licences and known anomalies."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from commands.shared.installed import Package

_LOCK = "requirements.lock"


def sbom(
    output: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="standard output")
    ] = None,
    lock: Annotated[
        Path | None,
        typer.Option(help="Requirements file with hashes.", show_default=f"{_LOCK} of the installation"),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--everything", help="Also what Spinewatch does not require.")
    ] = False,
    known_anomalies: Annotated[
        bool,
        typer.Option(
            "--known-anomalies",
            help="A list to read instead (IEC 62304): maker, version, licence, anomalies.",
        ),
    ] = False,
) -> None:
    """Write the software bill of materials of this installation as CycloneDX 1.6 JSON; needs no network."""
    import json  # noqa: PLC0415 - --help does not need it

    from commands.shared.bill_of_materials import bill_of_materials  # noqa: PLC0415
    from commands.shared.files import read_text, write_text  # noqa: PLC0415
    from commands.shared.installed import packages  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415

    path = lock or _lock_of_installation()
    found = packages("" if path is None else read_text(path), everything=everything)
    if known_anomalies:
        text = "\n".join(_lines(found)) + "\n"
    else:
        text = json.dumps(bill_of_materials(found, utc_now()), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_text(output, text)


def _lock_of_installation() -> Path | None:
    """Return the lock file of this installation: that of the source tree, or of the container image."""
    places = (Path(__file__).parents[1] / _LOCK, Path(sys.prefix) / "share" / "spinewatch" / _LOCK)
    return next((path for path in places if path.is_file()), None)


def _lines(packages: list[Package]) -> list[str]:
    """Return the list of software of unknown provenance: one line per package, its anomalies below it."""
    from commands.shared.anomalies import ANOMALIES  # noqa: PLC0415
    from commands.shared.bill_of_materials import runtime_components  # noqa: PLC0415

    lines = []
    for package in packages:
        lines.append(f"{package.name} {package.version}, {package.licence}, by {package.maker}")
        for anomaly in ANOMALIES:
            if anomaly.package == package.name:
                examined = "" if anomaly.version == package.version else f" (examined: {anomaly.version})"
                lines.append(f"  {anomaly.identifier}{examined}: {anomaly.behaviour} {anomaly.effect}")
                lines.append(f"    {anomaly.measure} ({anomaly.test})")
    for component in runtime_components():
        licence = component["licenses"][0]["license"]["id"]
        maker = component["supplier"]["name"]
        lines.append(f"{component['name']} {component['version']}, {licence}, by {maker}")
    return lines
