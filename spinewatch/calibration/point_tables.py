"""CSV of control points (``id,x_mm,y_mm,z_mm``) and of image points (with ``u_px,v_px``, and ``shot`` if several)."""

from __future__ import annotations

import csv
import io
import math

import numpy as np

from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.points import ImagePoints

_OBJECT = ("x_mm", "y_mm", "z_mm")
_IMAGE = ("u_px", "v_px")

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
    ids = tuple(cells["id"] for _, cells in lines)
    double = next((id_ for id_ in ids if ids.count(id_) > 1), None)
    if double is not None:
        raise ControlFieldError(f"{name} lists point {double} twice; remove one of the two lines")
    points = [[_number(cells, key, at, name, ControlFieldError) for key in _OBJECT] for at, cells in lines]
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
    for at, cells in _lines(text, ("id", *_OBJECT, *_IMAGE), name, PointsError):
        numbers = [_number(cells, key, at, name, PointsError) for key in (*_OBJECT, *_IMAGE)]
        by_shot.setdefault(cells.get("shot") or "1", []).append((cells["id"], numbers))
    out = {}
    for shot, points in by_shot.items():
        table = np.array([numbers for _, numbers in points])
        try:
            out[shot] = ImagePoints.build([id_ for id_, _ in points], table[:, :3], table[:, 3:])
        except PointsError as error:
            raise PointsError(f"{name}, shot {shot}: {error}") from error
    return out


def _lines(
    text: str, needed: tuple[str, ...], name: str, error: _TableError
) -> list[tuple[int, dict[str, str]]]:
    """Return number and cells by column of every line that is not blank."""
    stream = io.StringIO(text.lstrip("\ufeff"), newline=None)  # line ends of any system
    reader = csv.DictReader(stream, skipinitialspace=True)
    header = [h.strip() for h in reader.fieldnames or []]
    missing = [key for key in needed if key not in header]
    if missing:
        raise error(f"{name} has no column {missing[0]!r}; its first line must be {','.join(needed)}")
    reader.fieldnames = header
    lines = [
        (reader.line_num, {k: (v or "").strip() for k, v in cells.items() if isinstance(k, str)})
        for cells in reader
    ]
    lines = [(at, cells) for at, cells in lines if any(cells.values())]
    if not lines:
        raise error(f"{name} lists no point; give one per line")
    for at, cells in lines:
        if not cells["id"]:
            raise error(f"{name}, line {at}: the id is empty; name the point")
    return lines


def _number(cells: dict[str, str], key: str, at: int, name: str, error: _TableError) -> float:
    try:
        value = float(cells[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise error(f"{name}, line {at}: {key} is {cells[key]!r}; give a number, or leave the point out")
    return value
