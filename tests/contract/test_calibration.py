import json
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from contract.calibration import (
    CalibrationReport,
    CalibrationResult,
    ControlAccuracy,
    RemovedPoint,
)
from spinewatch.calibration.quality.accuracy import ShotAccuracy
from tests.store.builders import solved

IMAGE = {"sha256": "0" * 64, "media_type": "image/png", "width_px": 568, "height_px": 416, "size_bytes": 9}


def report(**changes: Any) -> dict[str, Any]:
    document = solved().model_dump(mode="json", exclude={"rig"})
    images = {"left": IMAGE, "right": IMAGE}
    shots = [{**shot, "number": n, "images": images} for n, shot in enumerate(document["shots"], start=1)]
    return {**document, "shots": shots, **changes}


def test_a_result_passes_through_json_unchanged() -> None:
    document = solved().model_dump(mode="json")
    assert "correlations_above_0.9" in document
    assert CalibrationResult.model_validate(json.loads(json.dumps(document))) == solved()


def test_a_report_shows_its_images_and_what_a_later_version_adds() -> None:
    made = CalibrationReport.model_validate(report(temperature_c=21.5)).model_dump(mode="json")
    assert made["shots"][0]["images"]["left"] == IMAGE
    assert made["temperature_c"] == 21.5
    with pytest.raises(ValidationError):
        CalibrationReport.model_validate(solved().model_dump(mode="json", exclude={"rig"}))


def test_a_report_of_an_earlier_version_has_no_limits() -> None:
    old = report()
    del old["limits"]
    for side in ("left", "right"):
        del old["cameras"][side]["sd_limits"]
    made = CalibrationReport.model_validate(old)
    assert made.limits is None
    assert made.cameras.left.sd_limits == {}


def test_a_removed_point_of_version_0_1_0_is_shown() -> None:
    old = {"side": "left", "shot": "1", "id": "A1", "miss_px": 2.5}
    assert RemovedPoint.model_validate(old).model_dump()["residual_px"] == 2.5


def test_residuals_of_too_few_points_have_no_standard_deviation() -> None:
    none = ShotAccuracy("1", True, (), np.empty((0, 3)))
    made = ControlAccuracy.of(none)
    assert (made.reconstructed, made.mean_mm, made.sd_mm) == (0, [None] * 3, [None] * 3)
    some = ShotAccuracy("1", False, ("A", "B"), np.array([[1.0, 2, 3], [3, 2, 1]]))
    assert ControlAccuracy.of(some).residuals_mm == {"A": [1.0, 2.0, 3.0], "B": [3.0, 2.0, 1.0]}
    assert ControlAccuracy.of(some).mean_mm == [2.0, 2.0, 2.0]
