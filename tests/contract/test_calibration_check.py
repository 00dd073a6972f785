from datetime import UTC, datetime

import pytest
from pydantic import ValidationError

from contract.calibration_check import CalibrationCheck, ChecksSummary

CHECK = {
    "surgery_id": "s",
    "stage": "PRE",
    "take": 1,
    "taken_at": datetime(2026, 11, 21, tzinfo=UTC),
    "age_days": -0.5,
    "drift": None,
    "flags": [{"code": "calibration-old", "detail": "old"}],
}


def test_a_check_may_have_too_few_balls() -> None:
    check = CalibrationCheck.model_validate(CHECK)
    assert (check.drift, check.flags[0].code) == (None, "calibration-old")
    with pytest.raises(ValidationError):
        CalibrationCheck.model_validate({**CHECK, "drift": {"balls": 3}})


def test_a_summary_counts() -> None:
    assert ChecksSummary(stages=3, drifted=1, old=2).model_dump() == {"stages": 3, "drifted": 1, "old": 2}
