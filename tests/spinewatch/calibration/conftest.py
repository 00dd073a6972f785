import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from spinewatch.arrays import Pixels
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.imaging.decoding import decode_image
from spinewatch.simulation.rigs import table_3_3_rig
from tests.paths import SAMPLES

CALIBRATION = SAMPLES / "calibration"
TYPICAL = tuple(str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18))


@pytest.fixture
def sensor() -> Sensor:
    return Sensor((568, 416), (0.01, 0.00845))


@pytest.fixture
def shot() -> Callable[..., Shot]:
    """A function that makes a shot of some pegs of the 1995 board by the rig of Table 3.3."""

    def make(
        name: str = "C",
        ids: Sequence[str] = TYPICAL,
        placement: RigidTransform | None = None,
        sigma_px: float = 0.0,
        seed: int = 0,
    ) -> Shot:
        rng = np.random.default_rng(seed)
        rig = table_3_3_rig()
        control = pegboard_1995().take(ids)
        points = control if placement is None else placement(control)
        left, right = (
            ImagePoints.build(ids, control, c.project(points) + sigma_px * rng.standard_normal((len(ids), 2)))
            for c in (rig.left, rig.right)
        )
        return Shot(name, left, right)

    return make


@pytest.fixture(scope="session")
def boards() -> dict[str, tuple[tuple[Pixels, Pixels], Any]]:
    """Pictures and truth of the sample boards by trial."""
    out = {}
    for folder in sorted((CALIBRATION / "C1").iterdir()):
        left, right = (decode_image((folder / f"{side}.png").read_bytes()) for side in ("left", "right"))
        out[folder.name] = ((left, right), json.loads((folder / "truth.json").read_text()))
    return out
