"""Flat printed boards as control fields: ``chessboard:9x6:25`` and ``charuco:7x5:40:30:DICT_5X5_100``."""

from __future__ import annotations

import re
from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import ControlFieldError
from spinewatch.numbers import NumberTextError, parse_number

_MIN_CORNERS = 3
_MAX_CORNERS = 40
_QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_CHESSBOARD = (
    "write chessboard:COLUMNSxROWS:SQUARE, with the numbers of inner corners and the size of a square in mm:"
    " chessboard:9x6:25"
)
_CHARUCO = (
    "write charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY, with the numbers of squares, the sizes of a square and of a"
    " marker in mm, and OpenCV's dictionary: charuco:7x5:40:30:DICT_5X5_100"
)


@dataclass(frozen=True)
class Chessboard:
    """A chessboard.

    Attributes
    ----------
    columns, rows
        Inner corners along and across.
    square_mm
        Size of a square, mm.
    """

    columns: int
    rows: int
    square_mm: float


@dataclass(frozen=True)
class Charuco:
    """A chessboard with an ArUco marker in each white square.

    Attributes
    ----------
    columns, rows
        Inner corners along and across: one less than the squares.
    square_mm
        Size of a square, mm.
    marker_mm
        Size of a marker, mm.
    dictionary
        OpenCV's name of the markers' dictionary, such as DICT_5X5_100.
    """

    columns: int
    rows: int
    square_mm: float
    marker_mm: float
    dictionary: str


@dataclass(frozen=True, eq=False)
class BoardField(ControlField):
    """The inner corners of a board as a control field.

    Attributes
    ----------
    board
        The board.
    """

    board: Chessboard | Charuco


def is_board(name: str) -> bool:
    """Return whether the name of a control field is that of a board.

    Parameters
    ----------
    name
        Name of the field.

    Returns
    -------
    bool
        Whether it begins with ``chessboard:`` or ``charuco:``.
    """
    return name.partition(":")[0].lower() in {"chessboard", "charuco"} and ":" in name


def board_field(name: str) -> BoardField:
    """Return the control field of a board.

    Parameters
    ----------
    name
        ``chessboard:COLUMNSxROWS:SQUARE`` or ``charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY``. The numbers of a
        chessboard are inner corners, those of a ChArUco board are squares, as in OpenCV; sizes in mm.

    Returns
    -------
    BoardField
        The inner corners, numbered by row from the far left, X to the right, Y up the board, Z out of it.

    Raises
    ------
    ControlFieldError
        If the name cannot be read or is of no possible board.

    Examples
    --------
    >>> field = board_field("chessboard:9x6:25")
    >>> len(field), field.take(["1", "54"]).tolist()
    (54, [[0.0, 125.0, 0.0], [200.0, 0.0, 0.0]])
    >>> len(board_field("charuco:7x5:40:30:DICT_5X5_100"))
    24
    """
    kind, *parts = name.split(":")
    board = _chessboard(name, parts) if kind.lower() == "chessboard" else _charuco(name, parts)
    r, c = np.indices((board.rows, board.columns))
    x, y = c * board.square_mm, (board.rows - 1 - r) * board.square_mm
    points = np.stack([x, y, np.zeros(r.shape)], axis=-1).reshape(-1, 3)
    return BoardField(name, tuple(str(i + 1) for i in range(len(points))), points, board)


def rotated(field: BoardField, quarter_turns: int) -> BoardField:
    """Return the field with its coordinates rotated about Z.

    Parameters
    ----------
    field
        The field.
    quarter_turns
        Number of rotations by 90 degrees, counterclockwise as seen from the front of the board.

    Returns
    -------
    BoardField
        The same corners in another frame, in which the least X and Y are again zero.

    Examples
    --------
    >>> rotated(board_field("chessboard:9x6:25"), 1).take(["1", "54"]).tolist()
    [[0.0, 0.0, 0.0], [125.0, 200.0, 0.0]]
    """
    points: Float = field.points_mm @ np.linalg.matrix_power(_QUARTER_TURN, quarter_turns % 4).T
    return BoardField(field.name, field.ids, np.asarray(points - points.min(axis=0)) + 0.0, field.board)


def _chessboard(name: str, parts: list[str]) -> Chessboard:
    if len(parts) != 2:
        raise ControlFieldError(f"{name!r} is no chessboard; {_CHESSBOARD}")
    columns, rows = _counts(name, parts[0], _CHESSBOARD)
    return Chessboard(columns, rows, _size(name, parts[1], _CHESSBOARD))


def _charuco(name: str, parts: list[str]) -> Charuco:
    if len(parts) != 4:
        raise ControlFieldError(f"{name!r} is no ChArUco board; {_CHARUCO}")
    columns, rows = (n - 1 for n in _counts(name, parts[0], _CHARUCO, more=1))
    square, marker = (_size(name, part, _CHARUCO) for part in parts[1:3])
    if marker >= square:
        raise ControlFieldError(
            f"{name!r}: a marker of {marker:g} mm does not fit into a square of {square:g} mm; {_CHARUCO}"
        )
    dictionary = parts[3].upper()
    dictionary = dictionary if dictionary.startswith("DICT_") else f"DICT_{dictionary}"
    known = sorted(n for n in dir(cv2.aruco) if n.startswith("DICT_") and n == n.upper())
    if dictionary not in known:
        raise ControlFieldError(
            f"{name!r}: OpenCV has no dictionary {parts[3]!r}; choose from {', '.join(known)}"
        )
    markers = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)
    needed = (columns + 1) * (rows + 1) // 2
    if needed > markers:
        raise ControlFieldError(
            f"{name!r}: the board has {needed} markers, dictionary {dictionary} {markers}; check both"
        )
    return Charuco(columns, rows, square, marker, dictionary)


def _counts(name: str, text: str, expected: str, more: int = 0) -> tuple[int, int]:
    """Return the numbers along and across a board; ``more`` is by how much they exceed the inner corners."""
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text.lower())
    counts = [int(n) for n in match.groups()] if match else []
    if len(counts) != 2 or not all(_MIN_CORNERS <= n - more <= _MAX_CORNERS for n in counts):
        raise ControlFieldError(
            f"{name!r}: {text!r} is not two numbers from {_MIN_CORNERS + more} to {_MAX_CORNERS + more}; {expected}"
        )
    return counts[0], counts[1]


def _size(name: str, text: str, expected: str) -> float:
    try:
        value = parse_number(text)
    except NumberTextError:
        value = 0.0
    if value <= 0:
        raise ControlFieldError(f"{name!r}: {text!r} is not a size in mm; {expected}")
    return value
