"""The TLS proxy: its limits are those of the service, and Caddy accepts the file where it is installed."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from settings import Settings
from tests.paths import PROJECT

TEXT = (PROJECT / "deploy" / "Caddyfile").read_text(encoding="utf-8")


def test_limits_are_not_below_those_of_the_service() -> None:
    (size,) = re.findall(r"max_size (\d+)MiB", TEXT)
    assert int(size) * 1024**2 == Settings.model_fields["max_upload_bytes"].default
    (header,) = re.findall(r"read_header (\d+)s", TEXT)
    assert int(header) >= Settings.model_fields["header_timeout_seconds"].default


def test_nothing_is_asked_of_the_internet() -> None:
    assert "auto_https disable_certs" in TEXT
    assert "admin off" in TEXT
    assert re.findall(r"https?://(?!\{\$SPINEWATCH_NAME\})", TEXT) == []


def test_events_are_not_held_back() -> None:
    assert "flush_interval -1" in TEXT


@pytest.mark.skipif(shutil.which("caddy") is None, reason="Caddy is not installed")
def test_caddy_accepts_it(tmp_path: Path) -> None:
    names = ["-subj", "/CN=spinewatch.test", "-days", "2", "-nodes"]
    files = ["-keyout", str(tmp_path / "key.pem"), "-out", str(tmp_path / "cert.pem")]
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", *names, *files], check=True, capture_output=True
    )
    file = tmp_path / "Caddyfile"
    file.write_text(TEXT.replace("/certs/", f"{tmp_path}/"), encoding="utf-8")
    checked = subprocess.run(
        ["caddy", "validate", "--adapter", "caddyfile", "--config", str(file)],
        env={**os.environ, "SPINEWATCH_NAME": "spinewatch.test", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stderr
    assert "Valid configuration" in checked.stdout + checked.stderr
