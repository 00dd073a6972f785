"""`spinewatch igtl`: pyigtl's own client receives what the real command sends, and its end is clean."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any

import numpy as np
import pyigtl
import pytest

from contract.job import JobState
from contract.summary import SurgerySummary
from exports import json_document
from exports.coordinates import RAS_FROM_PATIENT, transform
from tests.contract.spine_results import SURGERY, pose, summary
from tests.paths import PROJECT
from tests.patience import PATIENCE_S

PATIENCE_SECONDS = PATIENCE_S


class Command:
    """A running `spinewatch igtl`."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "commands", "igtl", "--port", "0", "--poll", "0.05", *arguments],
            cwd=PROJECT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.lines: list[str] = []
        stderr = self.process.stderr
        assert stderr is not None
        self._reader = Thread(target=lambda: self.lines.extend(iter(stderr.readline, "")), daemon=True)
        self._reader.start()

    def wait_for(self, pattern: str) -> re.Match[str]:
        found: re.Match[str] = patiently(
            lambda: next(filter(None, (re.search(pattern, line) for line in [*self.lines])), None)
        )
        return found

    def port(self) -> int:
        return int(self.wait_for(r"port (\d+)$")[1])

    def stop(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        status = self.process.wait(PATIENCE_SECONDS)
        self._reader.join(PATIENCE_SECONDS)
        return status


def patiently(look: Callable[[], Any]) -> Any:
    end = monotonic() + PATIENCE_SECONDS
    while monotonic() < end:
        found = look()
        if found is not None:
            return found
        sleep(0.02)
    raise AssertionError("waited in vain")


@contextmanager
def running(*arguments: str) -> Iterator[Command]:
    command = Command(*arguments)
    try:
        yield command
    finally:
        if command.process.poll() is None:
            command.process.kill()
        command.process.wait()
        for stream in (command.process.stdout, command.process.stderr):
            assert stream is not None
            stream.close()


@contextmanager
def client(port: int) -> Iterator[pyigtl.OpenIGTLinkClient]:
    receiver = pyigtl.OpenIGTLinkClient(port=port)
    try:
        yield receiver
    finally:
        receiver.stop()


def write(path: Path, held: SurgerySummary) -> None:
    """Replace a file at once, so that nobody reads half of it."""
    part = path.with_suffix(".part")
    part.write_bytes(json_document.export(held))
    os.replace(part, path)


def upto(stages: int) -> SurgerySummary:
    whole = summary()
    return whole.model_copy(update={"stages": whole.stages[:stages]})


@pytest.fixture
def document(tmp_path: Path) -> Path:
    path = tmp_path / "summary.json"
    write(path, upto(1))
    return path


def test_a_client_receives_every_vertebra_and_each_new_stage(document: Path) -> None:
    with running("--file", str(document)) as command, client(command.port()) as receiver:
        first = receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS)
        expected = pose("T9", 0)
        matrix = transform(RAS_FROM_PATIENT, expected.rotation, expected.position_mm)
        np.testing.assert_allclose(first.matrix, matrix, atol=1e-4)
        assert (first.metadata["Stage"], first.metadata["TransformStatus"]) == ("PRE", "OK")
        lost = receiver.wait_for_message("T5ToSpine", PATIENCE_SECONDS)
        assert (lost.metadata["Status"], lost.metadata["TransformStatus"]) == ("LOST", "MISSING")
        assert np.isnan(lost.matrix[:3]).all()
        write(document, upto(2))
        patiently(lambda: stage_of(receiver, "INTER"))
        assert command.stop() == 0
    assert any("sending stage INTER" in line for line in command.lines)


def test_a_vertebra_that_leaves_the_spine_is_sent_as_lost(document: Path) -> None:
    whole = upto(1)
    spine = whole.stages[0].spine
    assert spine is not None
    fewer = spine.model_copy(update={"vertebrae": [v for v in spine.vertebrae if v.vertebra != "T9"]})
    stage = whole.stages[0].model_copy(update={"spine": fewer, "take": 2})
    with running("--file", str(document)) as command, client(command.port()) as receiver:
        assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS).metadata["Status"] == "OK"
        write(document, whole.model_copy(update={"stages": [stage]}))
        assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS).metadata["Status"] == "LOST"
        assert command.stop() == 0


def test_a_latest_stage_without_a_spine_loses_every_vertebra_until_it_has_one(document: Path) -> None:
    hidden = upto(2)
    reason = "the reference triad L1 has no pose in stage INTER"
    hidden.stages[1] = hidden.stages[1].model_copy(update={"spine": None, "spine_reason": reason})
    running_job = upto(2)
    running_job.stages[1] = hidden.stages[1].model_copy(update={"state": JobState.RUNNING})
    with running("--file", str(document)) as command, client(command.port()) as receiver:
        assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS).metadata["Status"] == "OK"
        write(document, running_job)
        message = receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS)
        assert (message.metadata["Stage"], message.metadata["Status"]) == ("PRE", "OK")
        write(document, hidden)
        patiently(lambda: stage_of(receiver, "INTER"))
        with client(command.port()) as late:
            lost = late.wait_for_message("T9ToSpine", PATIENCE_SECONDS)
        assert (lost.metadata["Status"], lost.metadata["Reason"]) == ("LOST", reason)
        write(document, upto(2))
        patiently(lambda: receiver.wait_for_message("T9ToSpine").metadata["Status"] == "OK" or None)
        assert command.stop() == 0
    assert any("every vertebra is lost, the reference triad L1" in line for line in command.lines)


def stage_of(receiver: pyigtl.OpenIGTLinkClient, name: str) -> bool | None:
    message = receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS)
    return True if message is not None and message.metadata["Stage"] == name else None


def test_two_clients_and_one_that_leaves(document: Path) -> None:
    with running("--file", str(document)) as command:
        with client(command.port()) as first:
            assert first.wait_for_message("L1ToSpine", PATIENCE_SECONDS) is not None
        with client(command.port()) as second, client(command.port()) as third:
            assert second.wait_for_message("L1ToSpine", PATIENCE_SECONDS) is not None
            assert third.wait_for_message("T7ToSpine", PATIENCE_SECONDS) is not None
        assert command.stop() == 0


def test_what_a_client_sends_is_ignored(document: Path) -> None:
    with running("--file", str(document)) as command:
        with socket.create_connection(("127.0.0.1", command.port())) as rude:
            rude.sendall(os.urandom(200_000))
        with client(command.port()) as receiver:
            assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS) is not None
        assert command.stop() == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_cleanly_with_a_client_connected(document: Path, number: int) -> None:
    with running("--file", str(document)) as command, client(command.port()) as receiver:
        receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS)
        assert command.stop(number) == 0
        assert not any("Traceback" in line for line in command.lines)


def test_a_file_that_breaks_later_is_reported_and_the_last_stage_stays(document: Path) -> None:
    with running("--file", str(document)) as command:
        port = command.port()
        document.write_text("{")
        command.wait_for("is not JSON")
        with client(port) as receiver:
            assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS).metadata["Stage"] == "PRE"
        assert command.stop() == 0


def test_a_surgery_without_a_spine_waits_for_one(document: Path) -> None:
    write(document, upto(0))
    with running("--file", str(document)) as command, client(command.port()) as receiver:
        command.wait_for("no spine is measured yet")
        write(document, upto(1))
        assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS) is not None
        assert command.stop() == 0


def test_another_address_than_loopback_is_warned_of(document: Path) -> None:
    with running("--file", str(document), "--host", "0.0.0.0") as command:  # noqa: S104
        command.wait_for("warning: listening on 0.0.0.0")
        assert command.stop() == 0


@pytest.mark.parametrize(
    ("content", "words"),
    [("[]", "is no summary"), ('{"summary": {"surgery_id": 7}}', "is no summary"), ("\x00", "is not JSON")],
)
def test_a_file_that_is_no_summary_is_one_line(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "summary.json"
    path.write_text(content)
    refused(["--file", str(path)], words)


def test_a_stage_that_is_not_there_names_those_that_are(document: Path) -> None:
    refused(["--file", str(document), "--stage", "LATER"], "name one of its stages: PRE")


def test_neither_or_both_sources_are_refused(document: Path) -> None:
    refused([], "either a surgery or a file")
    refused([SURGERY, "--file", str(document)], "either a surgery or a file")


def test_a_port_in_use_is_one_line(document: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        refused(
            ["--file", str(document), "--port", str(taken.getsockname()[1])],
            "choose another --host or --port",
        )


def refused(arguments: list[str], words: str) -> None:
    with running(*arguments) as command:
        assert command.process.wait(PATIENCE_SECONDS) == 2
        assert command.wait_for(re.escape(words))
        assert len(command.lines) == 1


class Service(ThreadingHTTPServer):
    """Serves a summary as the service does: with an ETag, and 304 to who has it."""

    daemon_threads = True
    held = upto(1)
    unchanged = 0
    paths: set[str]


class Handler(BaseHTTPRequestHandler):
    server: Service

    def do_GET(self) -> None:
        self.server.paths.add(self.path)
        content = json.dumps(self.server.held.model_dump(mode="json")).encode()
        tag = f'"{hash(content)}"'
        known = self.headers["If-None-Match"] == tag
        self.server.unchanged += known
        self.send_response(304 if known else 200)
        self.send_header("ETag", tag)
        self.send_header("Content-Length", "0" if known else str(len(content)))
        self.end_headers()
        if not known:
            self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


@pytest.fixture
def service() -> Iterator[Service]:
    with Service(("127.0.0.1", 0), Handler) as server:
        server.paths = set()
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_a_running_service_is_asked_and_only_new_stages_are_sent(service: Service) -> None:
    url = f"http://127.0.0.1:{service.server_address[1]}"
    with running(SURGERY, "--url", url) as command, client(command.port()) as receiver:
        assert receiver.wait_for_message("T9ToSpine", PATIENCE_SECONDS).metadata["Stage"] == "PRE"
        patiently(lambda: service.unchanged or None)
        service.held = upto(3)
        patiently(lambda: stage_of(receiver, "POST"))
        assert command.stop() == 0
    assert service.paths == {f"/v1/surgeries/{SURGERY}/summary"}


def test_no_service_is_one_line() -> None:
    refused([SURGERY, "--url", "http://127.0.0.1:9"], "is the service running?")
