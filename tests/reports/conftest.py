import json
from collections.abc import Sequence
from typing import Any

import pytest
from typer.testing import CliRunner

from commands.main import cli
from tests.paths import SAMPLES

CALIBRATION = SAMPLES / "calibration"


def calibrate(*arguments: str) -> dict[str, Any]:
    ran = CliRunner().invoke(cli, ["calibrate", *arguments])
    assert ran.exit_code == 0, ran.exception
    document: dict[str, Any] = json.loads(ran.stdout)
    return document


def images(shots: Sequence[str]) -> list[str]:
    return [str(CALIBRATION / "C1" / shot / f"{side}.png") for shot in shots for side in ("left", "right")]


@pytest.fixture(scope="session")
def calibration() -> dict[str, Any]:
    """The document of a stereo calibration with one shot held out."""
    return calibrate(*images(["C", "A"]), "--control-field", "pegboard-1995", "--verify", "1")


@pytest.fixture(scope="session")
def cameras() -> dict[str, Any]:
    """The document of a calibration of three cameras."""
    files = [str(CALIBRATION / f"openptv/cam{number}.csv") for number in (3, 4, 1)]
    return calibrate(*files, "--image-size", "1280x1024", "--pixel-size", "0.012,0.012")
