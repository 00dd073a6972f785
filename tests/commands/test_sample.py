"""`spinewatch sample`: the sample surgery over HTTP against a real service and real workers."""

from __future__ import annotations

import re
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import httpx
import pytest

from tests.paths import PROJECT
from tests.patience import PATIENCE_S

SAMPLES = PROJECT / "samples"


def command(folder: Path, *options: object) -> list[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    base = [sys.executable, "-m", "commands", "sample", "--data-dir", folder / "var"]
    return [*map(str, base), *(["--port", str(port)] if "--port" not in options else []), *map(str, options)]


def run(folder: Path, *options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(folder, *options),
        capture_output=True,
        text=True,
        check=False,
        cwd=PROJECT,
        timeout=PATIENCE_S,
    )


@contextmanager
def serving(folder: Path, *options: object) -> Iterator[tuple[str, str]]:
    """Run the sample without --exit; yield the URL and the key of its service, and stop it at the end."""
    process = subprocess.Popen(command(folder, *options), stdout=subprocess.PIPE, text=True, cwd=PROJECT)
    assert process.stdout is not None
    with process:
        try:
            lines = (re.match(r"Open (\S+)/#key=(\S+)$", line) for line in process.stdout)
            found = next((match for match in lines if match), None)
            assert found, "the sample ended without serving"
            yield found[1], found[2]
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(PATIENCE_S)


def test_exit_prints_tables_and_stops_everything(tmp_path: Path) -> None:
    done = run(tmp_path, "--exit")
    assert done.returncode == 0, done.stdout + done.stderr
    out = done.stdout
    for stage in ("PRE", "INTER", "POST"):
        assert f"{stage}: succeeded" in out
        for vertebra in ("L1", "T11", "T9", "T7"):
            assert re.search(rf"^{stage}\s+{vertebra}\s+[\d.]+±[\d.]+", out, re.M)
    assert "Motion from PRE to INTER" in out
    assert re.search(r"^T7 .*±", out, re.M)
    assert "in object space of calibration dev_large" in out
    assert "reference triad L1" in out
    for stage in ("PRE", "INTER", "POST"):
        for measure in ("cobb-fixed", "apical-rotation"):
            change = "" if stage == "PRE" else r".*\[.*\]"
            pattern = rf"^{stage}\s+{measure}, curve 1\s+[T1-9L-]+\s+-?[\d.]+° \[.*\]\s+\w+\*{change}"
            assert re.search(pattern, out, re.M), (stage, measure)
    assert "in patient axes at stage PRE" in out
    url = re.search(r"Surgery:\s+(http://127\.0\.0\.1:\d+)/v1/surgeries/[0-9a-f-]{36}", out)
    assert url
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{url[1]}/v1/health")
    with closing(sqlite3.connect(tmp_path / "var" / "spinewatch.sqlite")) as database:
        rows = database.execute("SELECT name, revoked_at IS NULL FROM api_keys").fetchall()
    assert rows == [("sample", 0)]
    assert "sw_" not in (tmp_path / "var" / "service.log").read_text()


def test_keeps_serving_beside_another_program_until_it_is_stopped(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with serving(tmp_path, "--port", taken) as (url, key):
            assert not url.endswith(f":{taken}")
            assert httpx.get(f"{url}/v1/health").is_success
            assert (
                "SAMPLE-D1"
                in httpx.get(f"{url}/v1/surgeries", headers={"Authorization": f"Bearer {key}"}).text
            )
            again = run(tmp_path, "--url", url, "--key", key)
            broken = run(tmp_path, "--url", url, "--key", key, "--samples", broken_samples(tmp_path))
            locked_out = run(tmp_path, "--url", url)
    assert again.returncode == 0, again.stderr
    assert locked_out.returncode == 2
    assert "Authorization: Bearer" in locked_out.stderr
    assert broken.returncode == 1
    assert "INTER: failed" in broken.stdout
    assert "damaged or incomplete" in broken.stdout
    assert "no motion from PRE to INTER" in broken.stdout
    assert "Motion from PRE to POST" in broken.stdout
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{url}/v1/health")


def broken_samples(folder: Path) -> Path:
    """Return a copy of the samples in which one image is truncated."""
    samples = folder / "samples"
    shutil.copytree(SAMPLES, samples)
    image = samples / "D1" / "INTER" / "left.png"
    image.write_bytes(image.read_bytes()[:80_000])
    return samples


def test_unreachable_service_is_one_line(tmp_path: Path) -> None:
    done = run(tmp_path, "--url", "http://127.0.0.1:9")
    assert done.returncode == 2
    assert done.stderr.startswith("spinewatch: no answer from http://127.0.0.1:9")
    assert len(done.stderr.splitlines()) == 1


def test_missing_sample_is_one_line(tmp_path: Path) -> None:
    done = run(tmp_path, "--samples", tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "no sample surgery" in done.stderr


def test_service_that_cannot_start_says_why(tmp_path: Path) -> None:
    (tmp_path / "var").mkdir()
    (tmp_path / "var" / "spinewatch.sqlite").write_bytes(b"not a database, but longer than its header" * 20)
    done = run(tmp_path, "--exit")
    assert done.returncode == 2
    assert "the service did not start" in done.stderr
