from dataclasses import asdict

from spinewatch.calibration.plausibility.limits import CalibrationLimits


def test_each_range_has_a_lower_and_an_upper_end_and_the_usual_range_is_possible() -> None:
    parameters = CalibrationLimits()
    ranges = {name: value for name, value in asdict(parameters).items() if isinstance(value, tuple)}
    assert all(0 < low < high for low, high in ranges.values())
    (low, high), (near, far) = parameters.range_mm, parameters.usual_range_mm
    assert low <= near < far <= high


def test_a_calibration_is_flagged_before_it_is_refused() -> None:
    parameters = CalibrationLimits()
    assert 0 < parameters.doubtful < 1
    assert parameters.rms_of_single > 1
