import pytest

from spinewatch.calibration import errors
from spinewatch.calibration.errors import CalibrationError, UndeterminedError
from tests.paths import PROJECT

KINDS = [k for k in vars(errors).values() if isinstance(k, type) and issubclass(k, CalibrationError)]


def test_every_kind_of_error_has_a_code_of_its_own() -> None:
    codes = [kind.code for kind in KINDS]
    assert len(set(codes)) == len(codes) > 10


@pytest.mark.parametrize("kind", [k for k in KINDS if k is not CalibrationError])
def test_every_code_is_documented(kind: type[CalibrationError]) -> None:
    assert f"`{kind.code}`" in (PROJECT / "docs/calibration.md").read_text()


def test_undetermined_parameters_are_part_of_the_error() -> None:
    error = UndeterminedError("show more points", ("f", "K1"))
    assert str(error) == "show more points"
    assert error.names == ("f", "K1")
