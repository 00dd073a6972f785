"""``spinewatch igtl``: the spine of the latest stage of a surgery as OpenIGTLink messages."""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.exposure import is_loopback
from commands.shared.key_option import Key
from exports.text import single_line
from spinewatch.errors import ParameterError, SpinewatchError

if TYPE_CHECKING:
    from commands.shared.summary_source import SummarySource


def igtl(
    surgery: Annotated[
        str | None, typer.Argument(help="Identifier of a surgery of a running service.")
    ] = None,
    file: Annotated[
        Path | None, typer.Option(help="Instead: a JSON file with the summary of a surgery.")
    ] = None,
    url: Annotated[str, typer.Option(help="Address of the service.")] = "http://127.0.0.1:8000",
    key: Key = None,
    host: Annotated[
        str,
        typer.Option(help="Address to listen on; anything but this machine's own is open to its network."),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 for any.")] = 18944,
    stage: Annotated[
        str | None, typer.Option(help="Stage to send.", show_default="the latest one whose job has ended")
    ] = None,
    poll: Annotated[
        float, typer.Option(min=0.05, max=3600.0, help="Seconds between looks for a new stage.")
    ] = 1.0,
) -> None:
    """Send one TRANSFORM a vertebra and one TDATA to OpenIGTLink clients, and again when a new stage is measured."""
    from commands.shared.broadcast import Broadcast  # noqa: PLC0415 - --help does not need them
    from commands.shared.summary_source import FileSource, ServiceSource  # noqa: PLC0415

    if (surgery is None) == (file is None):
        raise ParameterError("name either a surgery or a file with its summary (--file)")
    source: SummarySource
    source = FileSource(file) if file is not None else ServiceSource(url, surgery or "", key=key)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    feed = _Feed(source, stage)
    with Broadcast(host, port) as server:
        content = feed.changed()
        if not is_loopback(host):
            _say(
                f"warning: listening on {host}; anyone on its network can read the poses, without encryption"
            )
        _say(f"OpenIGTLink on {host} port {server.port}")
        while True:
            if content is not None:
                server.send(content)
            if stop.wait(poll):
                return
            content = feed.changed_or_reported()


class _Feed:
    """The messages of a source, as bytes."""

    def __init__(self, source: SummarySource, stage: str | None) -> None:
        self._source = source
        self._stage = stage
        self._said = ""
        self._levels: dict[str, None] = {}

    def changed(self) -> bytes | None:
        """Return the messages of the latest stage whose job has ended, None when the source has nothing new.

        Without a spine of that stage every vertebra that clients may know is lost: the spine has moved since.
        """
        from contract.job import FINAL_STATES  # noqa: PLC0415 - --help needs neither pydantic nor NumPy
        from exports.openigtlink import stage_messages  # noqa: PLC0415
        from exports.selection import no_spine_reason, selected_stages  # noqa: PLC0415

        summary = self._source.changed()
        if summary is None:
            return None
        ended = [found for found in selected_stages(summary, self._stage) if found.state in FINAL_STATES]
        self._levels |= {
            state.vertebra: None
            for found in summary.stages
            if found.spine is not None
            for state in found.spine.vertebrae
        }
        if not ended or not self._levels:
            self._say_once("no spine is measured yet; waiting for one")
            return None
        latest = ended[-1]
        missing = "" if latest.spine is not None else f": every vertebra is lost, {no_spine_reason(latest)}"
        self._say_once(f"sending stage {latest.name}, take {latest.take}{missing}")
        messages = stage_messages(latest, summary.surgery_id, self._levels)
        return b"".join(message.pack() for message in messages)

    def changed_or_reported(self) -> bytes | None:
        """Return the same; a source that fails for a while is reported once and asked again."""
        try:
            return self.changed()
        except SpinewatchError as error:
            self._say_once(f"spinewatch: {error}")
            return None

    def _say_once(self, line: str) -> None:
        if line != self._said:
            _say(line)
        self._said = line


def _say(line: str) -> None:
    """Print a line on stderr, whatever a file or a service says in it."""
    print(single_line(line), file=sys.stderr, flush=True)  # noqa: T201
