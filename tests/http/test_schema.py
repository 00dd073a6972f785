"""The contract against the service: schemathesis in all its phases, requests from a seed, and no failure."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.http.harness import Service
from tests.paths import PROJECT

_CONFIGURATION = PROJECT / "tests" / "http" / "schemathesis.toml"
_EXAMPLES = 3
_PHASES = "examples,coverage,fuzzing,stateful"


@pytest.fixture
def private(tmp_path: Path) -> Iterator[Service]:
    """A service of the test's own: what is sent here must not appear in the lists of other tests."""
    with Service(tmp_path, SPINEWATCH_STREAM_SECONDS="0.2") as service:
        service.start("worker")
        yield service


@pytest.mark.timeout(1800)
def test_every_answer_is_as_the_contract_says(private: Service, tmp_path: Path) -> None:
    url = f"http://127.0.0.1:{private.port}"
    program = str(Path(sys.executable).with_name("schemathesis"))
    command = [program, "--config-file", str(_CONFIGURATION), "run"]
    options = ["--url", url, "--header", f"Authorization: Bearer {private.key}", "--phases", _PHASES]
    options += ["--max-examples", str(_EXAMPLES), "--seed", "1", "--request-timeout", "120"]
    ran = subprocess.run(
        [*command, f"{url}/openapi.json", *options],
        check=False,
        cwd=tmp_path,
        env={**os.environ, "NO_COLOR": "1"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, f"{ran.stdout}\n{ran.stderr}"
    for phase in _PHASES.split(","):
        assert f"{phase.capitalize()} (in" in ran.stdout
