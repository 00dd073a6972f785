import json
from dataclasses import fields, replace

import numpy as np
import pytest
from pydantic import ValidationError

from contract import stage
from contract.features import Feature
from contract.stage import RigCheck, StageResult
from spinewatch.detection.features import Features
from spinewatch.matching import rig_check
from spinewatch.matching.marker_scale import MarkerScale
from spinewatch.stage import StageMeasurement
from tests.contract.results import measurement


def result(measured: StageMeasurement) -> StageResult:
    return StageResult.of(measured, "0", {"max_age_days": 2.0})


def test_a_result_passes_through_json_unchanged() -> None:
    made = result(measurement())
    document = made.model_dump(mode="json")
    text = json.dumps(document, allow_nan=False)
    assert StageResult.model_validate(json.loads(text)) == made
    assert StageResult.model_validate(json.loads(text)).model_dump(mode="json") == document


def test_a_result_has_what_was_measured() -> None:
    document = result(measurement()).model_dump(mode="json")
    (feature,) = document["features"]["left"]
    assert feature == {
        "x": 10,
        "y": 20,
        "score": 0.75,
        "sd_px": [0.4, 0.6],
        "correlation": pytest.approx(1 / 24),
        "visible_fraction": 0.5,
        "manual": False,
    }
    assert document["features"]["right"] == []
    assert document["fields"] == {"left": [1, 2, 3, 4], "right": [5, 6, 7, 8]}
    assert document["exposure"] == {"left": "normal", "right": "glare"}
    assert document["flags"] == [{"code": "triad-count-low", "detail": "1 of 2"}]
    assert [triad["label"] for triad in document["triads"]] == ["L1", None]
    assert document["triads"][1]["label_reason"] == "no gap decides"
    assert document["rig_check"] is None
    assert (document["templates"], document["version"]) == ("test", "0")
    assert document["parameters"]["ball_diameter_mm"] == 8.0
    assert document["parameters"]["max_age_days"] == 2.0


def check() -> rig_check.RigCheck:
    values = {
        "balls": 12,
        "rms_px": 0.25,
        "chi2": 20.0,
        "dof": 4,
        "p_value": 0.0005,
        "off_epipolar": True,
        "rotation_deg": np.array([0.02, 0, 0]),
        "rotation_sd_deg": np.array([0.04, 0.1, 0.03]),
        "shift_mm": np.array([0.2, 0, 0]),
        "shift_sd_mm": np.array([0.4, 1, 0.3]),
        "marker_scale": MarkerScale(12, 0.998, 0.002, 0.001, 0.4, False, 0.07, 0.8),
    }
    known = {field.name for field in fields(rig_check.RigCheck)}
    return rig_check.RigCheck(**{name: value for name, value in values.items() if name in known})  # type: ignore[arg-type]


def test_the_check_of_the_rig_is_in_the_result() -> None:
    made = result(replace(measurement(), rig_check=check())).rig_check
    assert made == RigCheck(
        balls=12,
        rms_px=0.25,
        p_value=0.0005,
        drifted=True,
        rotation_deg=[0.02, 0, 0],
        rotation_sd_deg=[0.04, 0.1, 0.03],
        shift_mm=[0.2, 0, 0],
        shift_sd_mm=[0.4, 1, 0.3],
        marker_scale=stage.MarkerScale(
            distances=12,
            scale=0.998,
            sd=0.002,
            common_sd=0.001,
            p_value=0.4,
            drifted=False,
            yaw_deg=0.07,
            base_mm=0.8,
        ),
    )


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        result(replace(measurement(), rig_check=replace(check(), rms_px=value)))
    with pytest.raises(ValidationError, match="finite"):
        Feature.of(Features.with_sigma(np.array([[1.0, value]]), np.array([0.5]), 0.3))
