import json
from pathlib import Path

import numpy as np

from spinewatch.triads.model import FLAT_10_14_18

TABLES = json.loads((Path(__file__).parents[1] / "data/thesis_tables.json").read_text())


def test_distances_round_to_table_5_3() -> None:
    printed = TABLES["table_5_3_reference_mm"]
    expected = [printed["XX_YY"], printed["XX_MX"], printed["YY_MX"]]
    assert np.abs(FLAT_10_14_18.distances_mm - expected).max() < 0.05


def test_the_legs_meet_at_the_origin_and_the_normal_is_z() -> None:
    xx, yy, mx = FLAT_10_14_18.coordinates_mm
    assert [np.linalg.norm(b) for b in (xx, yy, mx)] == [18, 14, 10]
    assert np.allclose(xx / 18, -mx / 10)
    assert np.allclose(np.cross(xx - mx, xx - yy) / 392, [0, 0, 1])
