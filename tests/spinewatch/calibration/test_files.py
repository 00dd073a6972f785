from pathlib import Path

import pytest

from spinewatch.calibration.errors import ControlFieldError
from spinewatch.calibration.files import ShotFiles, calibrate_files, load_control_field, solve_parameters
from spinewatch.errors import ImageError, ParameterError, SameImageError
from tests.paths import SAMPLES
from tests.spinewatch.calibration.simulated import FIELD

C = SAMPLES / "calibration/C1/C"


def files(folder: Path = C) -> tuple[bytes, bytes]:
    return (folder / "left.png").read_bytes(), (folder / "right.png").read_bytes()


def test_files_become_a_calibration() -> None:
    result = calibrate_files([ShotFiles("C", *files())], FIELD, rig_name="cart")
    assert result.calibration.rig.name == "cart"
    assert [a.name for a in result.accuracy] == ["C"]
    assert result.geometry.baseline_mm == pytest.approx(421.9, abs=1.5)


def test_a_file_that_is_no_image_or_given_twice_is_named() -> None:
    left, right = files()
    with pytest.raises(ImageError, match="the right image of shot 1"):
        calibrate_files([ShotFiles("1", left, right[:20_000])], FIELD)
    with pytest.raises(SameImageError, match="the left image of shot 2 is also the left image of shot 1"):
        calibrate_files([ShotFiles("1", left, right), ShotFiles("2", left, b"")], FIELD)


def test_control_fields_are_built_in_or_from_csv() -> None:
    assert load_control_field("pegboard-1995").ids == FIELD.ids
    assert load_control_field("mine", "id,x_mm,y_mm,z_mm\na,0,0,0\n").name == "mine"
    with pytest.raises(ControlFieldError):
        load_control_field("mine")


def test_interior_parameters_are_free_or_fixed_by_name() -> None:
    parameters = solve_parameters(["f", "K1"], {"x0": 0.0}, False)
    assert parameters.free == ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "K1")
    assert parameters.fixed == {"x0": 0.0}
    assert solve_parameters(None, {}, True).free is None
    with pytest.raises(ParameterError, match="'zoom' is not a camera parameter"):
        solve_parameters(["zoom"], {}, False)
