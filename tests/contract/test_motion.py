import json

import numpy as np
import pytest

from contract.motion import Motion, VertebraMotion
from spinewatch.spine.motion import relative_motion
from tests.contract.results import pose


def test_a_motion_passes_through_json_to_the_last_bit() -> None:
    before = {"L1": pose(1), "T11": pose(2)}
    after = {"L1": pose(3), "T11": pose(4)}
    (given,) = relative_motion(before, after, "L1")
    document = json.loads(VertebraMotion.of(given).model_dump_json())
    assert document["vertebra"] == "T11"
    for name in set(document) - {"vertebra"}:
        np.testing.assert_array_equal(document[name], getattr(given, name))


def test_the_stages_are_named_from_and_to() -> None:
    stage = {"name": "PRE", "take": 1, "calibration_id": "c"}
    motion = Motion.model_validate(
        {
            "surgery_id": "s",
            "from": stage,
            "to": {**stage, "name": "POST"},
            "reference_vertebra": "L1",
            "frame": "reference triad L1",
            "vertebrae": [],
            "missing": [],
            "flags": [{"stage": "PRE", "code": "triad-count-low", "detail": "3 of 4 triads were found."}],
        }
    )
    assert motion.flags[0].stage == "PRE"
    assert motion.model_dump(by_alias=True)["from"]["name"] == "PRE"
    assert motion.end.name == "POST"


def test_a_motion_that_is_not_finite_is_refused() -> None:
    values = dict.fromkeys(VertebraMotion.model_fields, float("nan")) | {"vertebra": "T11"}
    with pytest.raises(ValueError, match="translation_mm"):
        VertebraMotion.model_validate(values)
