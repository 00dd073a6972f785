"""The data files of the programs of 1995, in a layout of ours: the thesis names their contents only.

Every file is a table of text: one row per line, columns separated by blanks, and lines that start with # are comments;
the first comment names the columns. Numbers of features, points and triads count from 1, as in the tables of the
thesis. `CameraParameters.dat` is the file of `spinewatch.rig_files.thesis_1995`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.errors import SpinewatchError
from spinewatch.numbers import NumberTextError, parse_number
from spinewatch.thesis_1995.match_point import MatchPoint

FEATURES = ("number", "u_px", "v_px", "score")
"""Columns of ``FEATURES.DAT``, ``PixelsLEFT.dat`` and ``PixelsRIGHT.dat``: a list of features of one image."""

MATCH_COORDINATES = ("number", "left", "right", "x_left_mm", "y_left_mm", "x_right_mm", "y_right_mm")
"""Columns of ``MatchCoords.dat``: pairs of features, and their plate coordinates without lens distortion."""

WORLD_POINTS = ("number", "X_mm", "Y_mm", "Z_mm")
"""Columns of ``WorldPoints.dat``: reconstructed points."""

RESIDUALS = ("number", "parallax_mm", "sd_X_mm", "sd_Y_mm", "sd_Z_mm", "chi_square")
"""Columns of ``SpacoOUT.dat``: how well the two rays of each point meet."""

TRIADS = ("number", "label", "X_mm", "Y_mm", "Z_mm", "n_X", "n_Y", "n_Z", "error_mm")
"""Columns of ``SpineStageX.dat``: the triads of stage X. A triad without a label has the label ``-``."""


class DataFileError(SpinewatchError):
    """A data file of 1995 cannot be read."""

    code = "invalid-data-file"


@dataclass(frozen=True, eq=False)
class FeatureList:
    """A list of features.

    Attributes
    ----------
    xy_px
        Positions (u, v), shape (n, 2), px.
    score
        Scores, shape (n,).
    """

    xy_px: Float
    score: Float


@dataclass(frozen=True, eq=False)
class MatchCoordinates:
    """Pairs of features that are to be reconstructed.

    Attributes
    ----------
    left, right
        Features of each pair, counted from 0, shape (n,).
    left_mm, right_mm
        Ideal plate coordinates relative to the principal points, shape (n, 2), mm.
    """

    left: Int
    right: Int
    left_mm: Float
    right_mm: Float


@dataclass(frozen=True, eq=False)
class TriadRecord:
    """One row of ``SpineStageX.dat``.

    Attributes
    ----------
    label
        Vertebra; None if it is not known.
    position_mm
        P, shape (3,), object space, mm.
    normal
        Unit normal, shape (3,).
    error_mm
        Error of the distance matrix, mm.
    """

    label: str | None
    position_mm: Float
    normal: Float
    error_mm: float


def format_features(features: FeatureList) -> str:
    """Return the text of a feature list.

    Parameters
    ----------
    features
        The features, in order.

    Returns
    -------
    str
        Text of ``FEATURES.DAT``.

    Examples
    --------
    >>> print(format_features(FeatureList(np.array([[15.0, 121.5]]), np.array([0.75]))))
    # 1 rows: number u_px v_px score
    1 15.0000 121.5000 0.750000
    <BLANKLINE>
    """
    rows = [
        (str(k), f"{u:.4f}", f"{v:.4f}", f"{score:.6f}")
        for k, ((u, v), score) in enumerate(zip(features.xy_px, features.score, strict=True), 1)
    ]
    return format_table(FEATURES, rows)


def parse_features(text: str) -> FeatureList:
    """Return a feature list.

    Parameters
    ----------
    text
        Text of a file as `format_features` writes it; the score may be missing in every row.

    Returns
    -------
    FeatureList
        The features, in order.

    Raises
    ------
    DataFileError
        If a row is not a feature.

    Examples
    --------
    >>> parse_features("1 15.0 121.5").xy_px
    array([[ 15. , 121.5]])
    """
    rows = _rows(text)
    if rows and all(len(words) == len(FEATURES) - 1 for _, words in rows):
        rows = [(line, [*words, "1"]) for line, words in rows]
    table = _numbers(rows, FEATURES)
    return FeatureList(table[:, 1:3], table[:, 3])


def format_match_coordinates(pairs: MatchCoordinates) -> str:
    """Return the text of ``MatchCoords.dat``.

    Parameters
    ----------
    pairs
        The pairs, in order.

    Returns
    -------
    str
        Text of the file.
    """
    plate = np.hstack([pairs.left_mm, pairs.right_mm])
    rows = [
        (str(k), str(i + 1), str(j + 1), *(f"{x:.6f}" for x in row))
        for k, (i, j, row) in enumerate(zip(pairs.left, pairs.right, plate, strict=True), 1)
    ]
    return format_table(MATCH_COORDINATES, rows)


def parse_match_coordinates(text: str) -> MatchCoordinates:
    """Return the pairs of ``MatchCoords.dat``.

    Parameters
    ----------
    text
        Text of the file.

    Returns
    -------
    MatchCoordinates
        The pairs, in order.

    Raises
    ------
    DataFileError
        If a row is not a pair.
    """
    table = _numbers(_rows(text), MATCH_COORDINATES)
    numbers = table[:, 1:3]
    if np.any(numbers != np.rint(numbers)) or np.any(numbers < 1):
        raise DataFileError(
            "numbers of features must be whole numbers from 1; correct the columns left and right"
        )
    left, right = (numbers.astype(np.intp) - 1).T
    return MatchCoordinates(left, right, table[:, 3:5], table[:, 5:7])


def format_world_points(points_mm: Float) -> str:
    """Return the text of ``WorldPoints.dat``.

    Parameters
    ----------
    points_mm
        Points, shape (n, 3), object space, mm.

    Returns
    -------
    str
        Text of the file.
    """
    return format_table(WORLD_POINTS, _numbered(points_mm))


def parse_world_points(text: str) -> Float:
    """Return the points of ``WorldPoints.dat``.

    Parameters
    ----------
    text
        Text of the file.

    Returns
    -------
    Float
        Points, shape (n, 3), object space, mm.

    Raises
    ------
    DataFileError
        If a row is not a point.
    """
    return _numbers(_rows(text), WORLD_POINTS)[:, 1:]


def format_residuals(found: MatchPoint) -> str:
    """Return the text of ``SpacoOUT.dat``.

    Parameters
    ----------
    found
        The reconstructed points.

    Returns
    -------
    str
        Text of the file.
    """
    points = found.points
    sd_mm = np.sqrt(np.diagonal(points.covariance_mm2, axis1=1, axis2=2))
    return format_table(RESIDUALS, _numbered(np.column_stack([points.parallax_mm, sd_mm, points.chi2])))


def parse_residuals(text: str) -> Float:
    """Return the rows of ``SpacoOUT.dat``.

    Parameters
    ----------
    text
        Text of the file.

    Returns
    -------
    Float
        Parallax, mm; standard deviations of X, Y and Z, mm; chi-square: shape (n, 5).

    Raises
    ------
    DataFileError
        If a row has other columns.
    """
    return _numbers(_rows(text), RESIDUALS)[:, 1:]


def format_triads(found: MatchPoint) -> str:
    """Return the text of ``SpineStageX.dat``.

    Parameters
    ----------
    found
        The triads of a stage.

    Returns
    -------
    str
        Text of the file, in order along the axis.
    """
    rows = [
        (
            str(k),
            triad.label or "-",
            *(f"{x:.4f}" for x in triad.position_mm),
            *(f"{x:.6f}" for x in triad.normal),
            f"{found.features[triad.triplet].error_mm:.4f}",
        )
        for k, triad in enumerate(found.triads, 1)
    ]
    return format_table(TRIADS, rows)


def parse_triads(text: str) -> tuple[TriadRecord, ...]:
    """Return the triads of ``SpineStageX.dat``.

    Parameters
    ----------
    text
        Text of the file.

    Returns
    -------
    tuple of TriadRecord
        The triads, in the order of the file.

    Raises
    ------
    DataFileError
        If a row is not a triad.
    """
    rows = _rows(text)
    numbers = _numbers([(line, [*words[:1], *words[2:]]) for line, words in rows], (TRIADS[0], *TRIADS[2:]))
    return tuple(
        TriadRecord(None if words[1] == "-" else words[1], row[1:4], row[4:7], float(row[7]))
        for (_, words), row in zip(rows, numbers, strict=True)
    )


def format_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the text of a data file.

    Parameters
    ----------
    columns
        Names of the columns.
    rows
        Entries of each row, without blanks.

    Returns
    -------
    str
        A comment with the columns, then one line per row.
    """
    lines = [f"# {len(rows)} rows: {' '.join(columns)}", *(" ".join(row) for row in rows)]
    return "\n".join(lines) + "\n"


def _numbered(values: Float) -> list[tuple[str, ...]]:
    return [(str(k), *(f"{x:.6f}" for x in row)) for k, row in enumerate(values, 1)]


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Return the number of each line that is a row, and its words."""
    lines = enumerate(text.removeprefix("\ufeff").splitlines(), 1)
    return [
        (number, line.split()) for number, line in lines if line.strip() and not line.lstrip().startswith("#")
    ]


def _number(line: int, word: str) -> float:
    try:
        return parse_number(word)
    except NumberTextError as error:
        raise DataFileError(f"line {line} contains {word!r}, which {error}; correct it") from error


def _numbers(rows: Sequence[tuple[int, Sequence[str]]], columns: Sequence[str]) -> Float:
    """Return rows as numbers, shape (n, columns)."""
    values = []
    for line, words in rows:
        if len(words) != len(columns):
            raise DataFileError(
                f"line {line} has {len(words)} entries; write {len(columns)}: {' '.join(columns)}"
            )
        values.append([_number(line, word) for word in words])
    return np.array(values, dtype=np.float64).reshape(-1, len(columns))
