from datetime import UTC, datetime

import pytest
from pydantic import ValidationError

from contract.calibration_check import CalibrationCheck, CalibrationChecks, ChecksSummary

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


def test_a_page_of_checks_has_the_scale_of_all_stages() -> None:
    scale = {
        "distances": 24,
        "scale": 0.99,
        "sd": 0.001,
        "common_sd": 0.001,
        "p_value": 1e-6,
        "drifted": True,
        "yaw_deg": -0.4,
        "base_mm": 4.0,
    }
    page = {"items": [CHECK], "total": 1, "limit": 50, "next_cursor": None}
    assert CalibrationChecks.model_validate({**page, "pooled_scale": scale}).pooled_scale is not None
    assert CalibrationChecks.model_validate({**page, "pooled_scale": None}).pooled_scale is None
