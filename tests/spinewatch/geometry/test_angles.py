import pytest

from spinewatch.errors import ParameterError
from spinewatch.geometry.angles import degrees_from_dms


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
