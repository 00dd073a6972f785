import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import ParameterError
from spinewatch.geometry.angles import degrees_from_dms, dms_from_degrees


@pytest.mark.parametrize(
    ("packed", "degrees"),
    [
        (0.0, 0.0),
        (163000.0, 16.5),
        (-163000.0, -16.5),
        (-50609.0, -5.1025),
        (151302.0, 15.217222),
        (12336.1, 1.393361),
    ],
)
def test_packed_angles_of_table_3_3(packed: float, degrees: float) -> None:
    assert degrees_from_dms(packed) == pytest.approx(degrees, abs=1e-6)


@pytest.mark.parametrize("packed", [6000.0, 60.0, -16012.5])
def test_sixty_minutes_or_seconds_are_no_angle(packed: float) -> None:
    with pytest.raises(ParameterError):
        degrees_from_dms(packed)


@given(st.floats(-180, 180))
def test_packing_and_unpacking_returns_the_angle(angle: float) -> None:
    assert degrees_from_dms(float(dms_from_degrees(angle))) == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(
    ("degrees", "packed"),
    [(-1e-13, "00000.0000000"), (59 / 60 + 59.99999999 / 3600, "10000.0000000"), (-0.5, "-03000.0000000")],
)
def test_rounding_carries_over_and_zero_has_no_sign(degrees: float, packed: str) -> None:
    assert dms_from_degrees(degrees) == packed
