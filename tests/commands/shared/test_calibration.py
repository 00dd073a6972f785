from pathlib import Path

import pytest

from commands.shared.calibration import (
    calibrate_images,
    calibrate_points,
    read_field,
    require_calibration_shots,
)
from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ParameterError
from tests.paths import SAMPLES

CAVITY = SAMPLES / "calibration" / "openptv"
BOARDS = SAMPLES / "calibration" / "C1"


def test_a_rig_from_two_tables_of_image_points() -> None:
    files = (CAVITY / "cam3.csv", CAVITY / "cam4.csv")
    document = calibrate_points(files, SolveParameters(), "1280x1024", "0.012,0.012", 0, "cavity")
    assert document["rig"]["name"] == "cavity"
    assert document["images"] == []
    assert set(document["timings_ms"]) == {"calibrate", "total"}


def test_shots_are_named_after_what_distinguishes_their_files() -> None:
    pairs = [(BOARDS / shot / "left.png", BOARDS / shot / "right.png") for shot in ("C", "A")]
    document = calibrate_images(pairs, "pegboard-1995", SolveParameters(), None, 1, "rig")
    assert [shot["name"] for shot in document["shots"]] == ["C", "A"]
    assert [(image["shot"], image["side"]) for image in document["images"]] == [
        ("C", "left"),
        ("C", "right"),
        ("A", "left"),
        ("A", "right"),
    ]


def test_both_files_must_have_the_same_shots(tmp_path: Path) -> None:
    paths = tmp_path / "left.csv", tmp_path / "right.csv"
    for path, shot in zip(paths, ("1", "2"), strict=True):
        path.write_text(f"shot,id,x_mm,y_mm,z_mm,u_px,v_px\n{shot},a,0,0,0,1,1\n")
    with pytest.raises(PointsError, match="shot 1 is in only one of the two files"):
        calibrate_points(paths, SolveParameters(), "568x416", None, 0, "rig")


@pytest.mark.parametrize("verify", [-1, 2, 3])
def test_a_shot_must_remain_to_calibrate_with(verify: int) -> None:
    require_calibration_shots(1, 2)
    with pytest.raises(ParameterError, match=f"--verify is {verify} of 2 shots"):
        require_calibration_shots(verify, 2)


def test_a_control_field_is_built_in_or_a_file(tmp_path: Path) -> None:
    path = tmp_path / "board.csv"
    path.write_text("id,x_mm,y_mm,z_mm\na,0,0,0\nb,1,0,0\nc,0,1,5\nd,1,1,9\n")
    assert read_field("pegboard-1995").name == "pegboard-1995"
    assert read_field(str(path)).name == "board.csv"
    with pytest.raises(ControlFieldError, match="choose from pegboard-1995"):
        read_field(str(tmp_path / "none.csv"))


def test_a_control_field_must_be_given() -> None:
    with pytest.raises(ParameterError, match="give --control-field"):
        calibrate_images([], None, SolveParameters(), None, 0, "rig")
