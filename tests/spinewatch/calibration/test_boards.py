"""Names of boards and their control fields."""

import numpy as np
import pytest

from spinewatch.calibration.boards import BoardField, Charuco, Chessboard, board_field, is_board, rotated
from spinewatch.calibration.errors import ControlFieldError
from spinewatch.calibration.files import load_control_field


def test_a_chessboard_is_named_by_its_inner_corners() -> None:
    field = load_control_field("chessboard:9x6:25")
    assert isinstance(field, BoardField)
    assert field.board == Chessboard(9, 6, 25.0)
    assert len(field) == 54
    assert np.ptp(field.points_mm, axis=0).tolist() == [200.0, 125.0, 0.0]


def test_a_charuco_board_is_named_by_its_squares_and_its_dictionary_in_either_spelling() -> None:
    board = Charuco(6, 4, 40.0, 30.0, "DICT_5X5_100")
    assert board_field("charuco:7x5:40:30:DICT_5X5_100").board == board
    assert board_field("charuco:7x5:40:30:5x5_100").board == board


@pytest.mark.parametrize("turns", range(-1, 5))
def test_a_rotated_field_is_the_same_board(turns: int) -> None:
    field = board_field("chessboard:9x6:25")
    other = rotated(field, turns)
    d, e = (np.linalg.norm(f.points_mm[:, None] - f.points_mm[None], axis=2) for f in (field, other))
    np.testing.assert_allclose(d, e)
    assert other.points_mm.min() == 0
    a, b = other.take(["2"]) - other.take(["1"]), other.take(["1"]) - other.take(["10"])
    assert np.cross(a, b)[0, 2] > 0


def test_other_names_are_no_boards() -> None:
    assert not is_board("pegboard-1995")
    assert not is_board("chessboard")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("chessboard:9x6", "is no chessboard"),
        ("chessboard:9:25", "is not two numbers"),
        ("chessboard:2x6:25", "from 3 to 40"),
        ("chessboard:999x999:25", "from 3 to 40"),
        ("chessboard:9x6:0", "is not a size"),
        ("chessboard:9x6:nan", "is not a size"),
        ("charuco:7x5:40:30", "is no ChArUco board"),
        ("charuco:7x5:30:40:DICT_5X5_100", "does not fit"),
        ("charuco:7x5:40:30:DICT_9X9", "has no dictionary"),
        ("charuco:20x20:40:30:DICT_5X5_100", "200 markers"),
    ],
)
def test_boards_that_cannot_be_are_refused(name: str, message: str) -> None:
    with pytest.raises(ControlFieldError, match=message):
        load_control_field(name)
