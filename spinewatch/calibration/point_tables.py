"""CSV of control points (``id,x_mm,y_mm,z_mm``) and of image points (with ``u_px,v_px``, and ``shot`` if several).

Fields are separated by commas, semicolons or tabs, whichever divides the first line into the columns. Decimal commas
are read where fields are not separated by commas and no number of the file has a decimal point.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.points import ImagePoints
from spinewatch.numbers import NumberTextError, parse_number

_OBJECT = ("x_mm", "y_mm", "z_mm")
_IMAGE = ("u_px", "v_px")
_SEPARATORS = (",", ";", "\t")

_TableError = type[ControlFieldError] | type[PointsError]


def parse_control_field(text: str, name: str) -> ControlField:
    r"""Return the control field of a CSV text.

    Parameters
    ----------
    text
        CSV with the columns ``id,x_mm,y_mm,z_mm``.
    name
        Name of the field, also used in error messages.

    Returns
    -------
    ControlField
        The field, in the order of the lines.

    Raises
    ------
    ControlFieldError
        If a line cannot be used; the message gives its number.

    Examples
    --------
    >>> parse_control_field("id,x_mm,y_mm,z_mm\nA,0,0,0\nB,10,0,5\n", "two").points_mm
    array([[ 0.,  0.,  0.],
           [10.,  0.,  5.]])
    """
    lines = _lines(text, ("id", *_OBJECT), name, ControlFieldError)
    ids = tuple(line.cells["id"] for line in lines)
    double = next((id_ for id_ in ids if ids.count(id_) > 1), None)
    if double is not None:
        raise ControlFieldError(f"{name} lists point {double} twice; remove one of the two lines")
    points = [[_number(line, key, name, ControlFieldError) for key in _OBJECT] for line in lines]
    return ControlField(name, ids, np.array(points, dtype=np.float64).reshape(-1, 3))


def control_field_csv(field: ControlField) -> str:
    """Return a control field as CSV.

    Parameters
    ----------
    field
        The field.

    Returns
    -------
    str
        CSV from which `parse_control_field` reads exactly the same numbers.
    """
    lines = (
        f"{id_},{x!r},{y!r},{z!r}" for id_, (x, y, z) in zip(field.ids, field.points_mm.tolist(), strict=True)
    )
    return "\n".join([",".join(("id", *_OBJECT)), *lines]) + "\n"


def parse_image_points(text: str, name: str) -> dict[str, ImagePoints]:
    """Return the image points of one camera by shot.

    Parameters
    ----------
    text
        CSV with the columns ``id,x_mm,y_mm,z_mm,u_px,v_px`` and, for several shots, ``shot``.
    name
        Name of the file, used in error messages.

    Returns
    -------
    dict of str to ImagePoints
        Points by shot, in order of appearance; without a column ``shot`` there is one, "1".

    Raises
    ------
    PointsError
        If a line cannot be used; the message gives its number.
    """
    by_shot: dict[str, list[tuple[str, list[float]]]] = {}
    for line in _lines(text, ("id", *_OBJECT, *_IMAGE), name, PointsError):
        numbers = [_number(line, key, name, PointsError) for key in (*_OBJECT, *_IMAGE)]
        by_shot.setdefault(line.cells.get("shot") or "1", []).append((line.cells["id"], numbers))
    out = {}
    for shot, points in by_shot.items():
        table = np.array([numbers for _, numbers in points])
        try:
            out[shot] = ImagePoints.build([id_ for id_, _ in points], table[:, :3], table[:, 3:])
        except PointsError as error:
            raise PointsError(f"{name}, shot {shot}: {error}") from error
    return out


@dataclass(frozen=True)
class _Line:
    """Number of a line, and its cells by column."""

    at: int
    cells: dict[str, str]


def _lines(text: str, needed: tuple[str, ...], name: str, error: _TableError) -> list[_Line]:
    """Return every line that is not blank; numbers have decimal points."""
    text = text.lstrip("\ufeff")
    separator = _separator(text, needed)
    stream = io.StringIO(text, newline=None)  # line ends of any system
    reader = csv.reader(stream, delimiter=separator, skipinitialspace=True)
    header = [h.strip() for h in next(reader, [])]
    missing = [key for key in needed if key not in header]
    if missing:
        raise error(f"{name} has no column {missing[0]!r}; its first line must be {','.join(needed)}")
    double = next((key for key in header if key and header.count(key) > 1), None)
    if double is not None:
        raise error(f"{name} has column {double!r} twice; remove one of the two")
    lines = []
    for row in reader:
        cells = [cell.strip() for cell in row]
        if any(cells):
            _check_fields(cells, len(header), reader.line_num, name, error)
            lines.append(_Line(reader.line_num, dict(zip(header, cells, strict=False))))
    if not lines:
        raise error(f"{name} lists no point; give one per line")
    for line in lines:
        if not line.cells["id"]:
            raise error(f"{name}, line {line.at}: the id is empty; name the point")
    return lines if separator == "," else _with_decimal_points(lines, needed, name, error)


def _separator(text: str, needed: tuple[str, ...]) -> str:
    """Return the separator that divides the first line into the needed columns, a comma if none does."""
    first = text.splitlines()[0] if text else ""
    return next(
        (s for s in _SEPARATORS if set(needed) <= {cell.strip(' "') for cell in first.split(s)}),
        _SEPARATORS[0],
    )


def _check_fields(cells: list[str], n_columns: int, at: int, name: str, error: _TableError) -> None:
    """Check that a line has a field per column; empty fields at its end do not count as surplus."""
    if len(cells) < n_columns or any(cells[n_columns:]):
        raise error(
            f"{name}, line {at}: {len(cells)} fields for {n_columns} columns; give one per column, and write numbers"
            " with decimal points: with decimal commas, separate the fields by semicolons"
        )


def _with_decimal_points(
    lines: list[_Line], needed: tuple[str, ...], name: str, error: _TableError
) -> list[_Line]:
    """Return lines with decimal commas replaced; numbers of both kinds in one file are ambiguous and refused."""
    numeric = needed[1:]
    with_comma = next((line for line in lines if any("," in line.cells[key] for key in numeric)), None)
    if with_comma is None:
        return lines
    with_point = next((line for line in lines if any("." in line.cells[key] for key in numeric)), None)
    if with_point is not None:
        raise error(
            f"{name}, line {with_comma.at}: a number with a comma, while line {with_point.at} has one with a point;"
            " write all numbers with decimal points"
        )
    return [
        _Line(line.at, {k: v.replace(",", ".", 1) if k in numeric else v for k, v in line.cells.items()})
        for line in lines
    ]


def _number(line: _Line, key: str, name: str, error: _TableError) -> float:
    try:
        return parse_number(line.cells[key])
    except NumberTextError as reason:
        raise error(
            f"{name}, line {line.at}: {key} is {line.cells[key]!r}, which {reason}; give a number,"
            " or leave the point out"
        ) from reason
