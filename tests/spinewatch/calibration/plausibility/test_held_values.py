"""A value that was held is compared with what the points show."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spinewatch.calibration.plausibility.held_values import held_value_doubts
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import Shot
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.flags import Flag
from tests.spinewatch.calibration.simulated import FIELD, SENSORS, WIDE, WIDE_SENSOR, image, stereo_shot

LIMITS = CalibrationLimits()


def doubts(fixed: dict[str, float], limits: CalibrationLimits = LIMITS) -> tuple[Flag, ...]:
    solved = calibrate_stereo([stereo_shot(sigma_px=0.05)], SENSORS, SolveParameters(fixed=fixed))
    return held_value_doubts(solved.adjustment, ("left", "right"), fixed, limits)


def test_a_nominal_focal_length_is_contradicted_with_both_values() -> None:
    flags = doubts({"f": 8.0})
    assert {flag.code for flag in flags} == {"held-value-contradicted"}
    assert [flag.detail.partition(":")[0] for flag in flags] == ["left", "right"]
    assert "f was held at 8, and the points show 7." in flags[0].detail


def test_the_true_value_is_not_contradicted() -> None:
    left, right = (
        image(camera, FIELD.ids, sigma_px=0.05, seed=k) for k, camera in enumerate((WIDE.left, WIDE.right))
    )
    fixed = {"f": WIDE.left.focal_length_mm}
    solved = calibrate_stereo(
        [Shot("1", left, right)], (WIDE_SENSOR, WIDE_SENSOR), SolveParameters(fixed=fixed)
    )
    assert WIDE.right.focal_length_mm == fixed["f"]
    assert not held_value_doubts(solved.adjustment, ("left", "right"), fixed, LIMITS)


def test_the_limit_counts_deviations() -> None:
    assert not doubts({"f": 8.0}, replace(LIMITS, sigmas=1e6))


@pytest.mark.parametrize("held", [{}, {"P1": 0.0}])
def test_what_nobody_held_or_the_points_agree_with_raises_nothing(held: dict[str, float]) -> None:
    assert not doubts(held)
