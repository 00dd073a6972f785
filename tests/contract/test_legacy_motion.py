import json

import numpy as np
import pytest

from contract.legacy_motion import LegacyMotion, TriadRow
from spinewatch.spine.legacy_1995 import legacy_motion, triad_table
from tests.contract.results import pose


def test_rows_and_motions_pass_through_json_to_the_last_bit() -> None:
    before, after = (triad_table({"L1": pose(a), "T11": pose(b)}, "L1") for a, b in ((1, 2), (3, 4)))
    motions = legacy_motion(before, after)
    assert (len(before), len(motions)) == (2, 2)
    for row in before:
        document = json.loads(TriadRow.of(row).model_dump_json())
        for name in set(document) - {"vertebra"}:
            np.testing.assert_array_equal(document[name], getattr(row, name))
    for motion in motions:
        document = json.loads(LegacyMotion.of(motion).model_dump_json())
        for name in set(document) - {"vertebra"}:
            np.testing.assert_array_equal(document[name], getattr(motion, name))


def test_numbers_that_are_not_finite_are_refused() -> None:
    values = dict.fromkeys(LegacyMotion.model_fields, float("nan")) | {
        "vertebra": "T11",
        "axis": [0.0, 0.0, 1.0],
    }
    with pytest.raises(ValueError, match="angle_deg"):
        LegacyMotion.model_validate(values)
