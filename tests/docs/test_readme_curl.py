"""The README's curl calls, as they stand, against a real service."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from commands.shared.local_service import LocalService
from tests.paths import PROJECT
from tests.patience import PATIENCE_S


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_readme_calls_work(tmp_path: Path) -> None:
    blocks = re.findall(r"```sh\n(.*?)```", (PROJECT / "README.md").read_text(), re.S)
    script = "\n".join(block for block in blocks if "curl" in block)
    with LocalService(tmp_path, 8300) as service:
        script = script.replace("http://127.0.0.1:8000", service.url)
        done = subprocess.run(
            ["bash", "-euc", script],
            capture_output=True,
            text=True,
            check=False,
            cwd=PROJECT,
            timeout=PATIENCE_S,
            env={**os.environ, "SPINEWATCH_KEY": service.key},
        )
    assert done.returncode == 0, done.stderr
    assert '"kind":"calibration"' in done.stdout
    assert '"rotation_vector_deg"' in done.stdout
    assert '"T11"' in done.stdout
