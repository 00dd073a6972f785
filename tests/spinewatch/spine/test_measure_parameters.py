import pytest

from spinewatch.errors import ParameterError
from spinewatch.spine.measure_parameters import MeasureParameters


def test_the_least_cobb_angle_is_that_of_the_srs() -> None:
    assert MeasureParameters().min_cobb_deg == 10.0
    assert MeasureParameters().kyphosis[0] == ("T5", "T12")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("min_cobb_deg", -1.0),
        ("min_cobb_deviations", float("nan")),
        ("tilt_roughness_deg", 0.0),
        ("offset_roughness_mm", float("inf")),
        ("max_azimuth_sd_deg", 30.0),
    ],
)
def test_impossible_numbers_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=f"{name} is .*; give"):
        MeasureParameters(**{name: value})  # type: ignore[arg-type]
