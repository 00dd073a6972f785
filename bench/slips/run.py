"""The command line, called in this process: its exit status, what it printed, and its JSON."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import traceback
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from bench.slips.slip import Answer, Outcome, Slip
from bench.slips.sound import SAMPLES, STAGES


def run_slip(slip: Slip, folder: Path) -> Outcome:
    """Make a slip in an empty folder, give it to the command line, and return the outcome."""
    if slip.make is None:
        raise ValueError(f"{slip.name!r} is asked of the service")
    answer = run_command(slip.command, slip.make(folder))
    if slip.command == "process" and slip.pair in STAGES and answer.status == 0:
        answer = replace(answer, document={**answer.document, **_error(answer.document, slip.pair)})
    return Outcome(slip, answer)


def run_command(command: str, arguments: Sequence[object]) -> Answer:
    """Call ``spinewatch COMMAND ARGUMENTS`` in this process.

    In the message the names of the files are replaced by FILE, so that no pattern finds its word in a name.
    """
    from commands.main import app  # noqa: PLC0415 - loads nothing until a slip is run

    out, err, before = _Out(), _Err(), sys.argv
    sys.argv = ["spinewatch", command, *map(str, arguments)]
    status: int | None = 0
    start = process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            app()
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except Exception:  # whatever passes the command line is a traceback on the user's screen
        status = None
        err.write(traceback.format_exc())
    finally:
        sys.argv = before
    seconds = process_time() - start
    document = _document(out.getvalue())
    message = err.getvalue() if document else err.getvalue() + out.getvalue()
    if status == 2 and "Usage:" in message:
        status = 1  # the parser of options did not understand the slip: the slip, not the answer, is at fault
    return Answer(status, _without_names(message, arguments), document, seconds)


class _Out(io.StringIO):
    """Standard output in UTF-8: what cannot be encoded raises."""

    def write(self, text: str) -> int:
        text.encode("utf-8")
        return super().write(text)


class _Err(io.StringIO):
    """Standard error: what cannot be encoded is escaped."""

    def write(self, text: str) -> int:
        return super().write(text.encode("utf-8", "backslashreplace").decode())


def _without_names(message: str, arguments: Sequence[object]) -> str:
    for argument in map(str, arguments):
        if "/" in argument and Path(argument).exists():
            path = Path(argument)
            message = message.replace(argument, "FILE").replace(path.name, "FILE")
            message = message.replace(str(path.parent), "FOLDER")
    return message


def _document(text: str) -> Mapping[str, Any]:
    try:
        document = json.loads(text)
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}


def _error(document: Mapping[str, Any], stage: str) -> Mapping[str, float]:
    """Return the largest error of a labelled triad, in mm and in standard deviations; empty without one."""
    truth = json.loads((SAMPLES / "D1" / stage / "truth.json").read_text())["triads"]
    places = {triad["vertebra"]: np.array(triad["P_mm"]) for triad in truth}
    nearest = np.stack(list(places.values()))
    errors = []
    for triad in document.get("triads", ()):
        if triad["position_mm"] is None:
            continue
        found, deviation = np.array(triad["position_mm"]), np.array(triad["position_sd_mm"])
        true = places.get(triad["label"])
        if true is None:
            true = nearest[np.linalg.norm(nearest - found, axis=1).argmin()]
        errors.append((np.linalg.norm(found - true), np.abs((found - true) / deviation).max()))
    if not errors:
        return {}
    off, sigma = np.max(errors, axis=0)
    return {"off_mm": float(off), "off_sd": float(sigma)}
