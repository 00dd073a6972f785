import json
from typing import Any

import pytest

from spinewatch.arrays import Pixels
from spinewatch.imaging.decoding import decode_image
from tests.paths import SAMPLES


@pytest.fixture(scope="session")
def boards() -> dict[str, tuple[tuple[Pixels, Pixels], Any]]:
    """Images and truth of the sample boards by trial."""
    out = {}
    for folder in sorted((SAMPLES / "calibration/C1").iterdir()):
        left, right = (decode_image((folder / f"{side}.png").read_bytes()) for side in ("left", "right"))
        out[folder.name] = ((left, right), json.loads((folder / "truth.json").read_text()))
    return out
