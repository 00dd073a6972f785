"""Printed tables of the thesis."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

SAMPLES = Path(__file__).parents[2] / "samples"
"""The sample surgery, whose labels along the spine are L1, T11, T9, T7."""

_TABLES = Path(__file__).parents[2] / "tests" / "data" / "thesis_tables.json"

TABLE_4_4_PX = (0.67, 0.17, 0.96, 0.71, 0.64, 0.67)
"""Table 4.4: means of the errors along x and y and of their length, and their standard deviations, px."""

TABLE_4_4_FALSE = 17
"""Table 4.4: false positives in the image."""

TABLE_5_1_PERCENT = (100.0,) * 8 + (89.6,) + (100.0,) * 3
TABLE_5_2_PERCENT = (100.0, 100.0, 100.0, 66.6, 90.0, 55.1, 77.7) + (100.0,) * 5
"""Correlation of a feature's match as a percentage of the greatest one, features #0 to #11."""

TIMES_S = {"spatial correlation": 240.0, "Fourier transforms": 24.0, "roots only": 5.0}
"""Section 7.2: times per image on an IBM RS/6000, measured for the first and expected for the others."""


def printed(table: str) -> Any:
    """Return a table by its name in ``tests/data/thesis_tables.json``."""
    return json.loads(_TABLES.read_text(encoding="utf-8"))[table]
