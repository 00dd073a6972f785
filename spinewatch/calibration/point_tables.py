"""CSV of control points (``id,x_mm,y_mm,z_mm``) and of image points (with ``u_px,v_px``, and ``shot`` if several)."""

from __future__ import annotations

import csv
import io
import math

import numpy as np

from spinewatch.calibration.control_field import BUILT_IN, ControlField
from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.points import ImagePoints

_OBJECT = ("x_mm", "y_mm", "z_mm")
_IMAGE = ("u_px", "v_px")


def parse_control_field(text: str, name: str) -> ControlField:
    """Return the control field of a CSV text; raise ``ControlFieldError`` naming the line that cannot be used."""
    rows = _rows(text, ("id", *_OBJECT), name, ControlFieldError)
    ids = tuple(row["id"] for _, row in rows)
    double = next((id_ for id_ in ids if ids.count(id_) > 1), None)
    if double is not None:
        raise ControlFieldError(f"{name} lists point {double} twice; remove one of the two lines")
    points = [[_number(row, key, line, name, ControlFieldError) for key in _OBJECT] for line, row in rows]
    return ControlField(name, ids, np.array(points, dtype=np.float64).reshape(-1, 3))


def control_field_csv(field: ControlField) -> str:
    """Return a control field as CSV; ``parse_control_field`` gives back the same numbers."""
    lines = (
        f"{id_},{x!r},{y!r},{z!r}" for id_, (x, y, z) in zip(field.ids, field.points_mm.tolist(), strict=True)
    )
    return "\n".join([",".join(("id", *_OBJECT)), *lines]) + "\n"


def built_in_field(name: str) -> ControlField | None:
    """Return the built-in control field of that name, or None."""
    return BUILT_IN[name]() if name in BUILT_IN else None


def parse_image_points(text: str, name: str) -> dict[str, ImagePoints]:
    """Return one camera's image points by shot, in order of appearance; without a ``shot`` column there is one, "1".

    Raises ``PointsError`` naming the line that cannot be used.
    """
    rows = _rows(text, ("id", *_OBJECT, *_IMAGE), name, PointsError)
    by_shot: dict[str, list[tuple[str, list[float]]]] = {}
    for line, row in rows:
        numbers = [_number(row, key, line, name, PointsError) for key in (*_OBJECT, *_IMAGE)]
        by_shot.setdefault(row.get("shot") or "1", []).append((row["id"], numbers))
    out = {}
    for shot, points in by_shot.items():
        table = np.array([numbers for _, numbers in points])
        try:
            out[shot] = ImagePoints.build([id_ for id_, _ in points], table[:, :3], table[:, 3:])
        except PointsError as error:
            raise PointsError(f"{name}, shot {shot}: {error}") from error
    return out


def _rows(
    text: str, needed: tuple[str, ...], name: str, error: type[ControlFieldError] | type[PointsError]
) -> list[tuple[int, dict[str, str]]]:
    lines = io.StringIO(text.lstrip("\ufeff"), newline=None)  # any system's line ends
    reader = csv.DictReader(lines, skipinitialspace=True)
    header = [h.strip() for h in reader.fieldnames or []]
    missing = [key for key in needed if key not in header]
    if missing:
        raise error(f"{name} has no column {missing[0]!r}; its first line must be {','.join(needed)}")
    reader.fieldnames = header
    rows = [
        (reader.line_num, {k: (v or "").strip() for k, v in row.items() if isinstance(k, str)})
        for row in reader
    ]
    rows = [(line, row) for line, row in rows if any(row.values())]
    if not rows:
        raise error(f"{name} lists no point; give one a line")
    for line, row in rows:
        if not row["id"]:
            raise error(f"{name}, line {line}: the id is empty; name the point")
    return rows


def _number(
    row: dict[str, str], key: str, line: int, name: str, error: type[ControlFieldError] | type[PointsError]
) -> float:
    try:
        value = float(row[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise error(f"{name}, line {line}: {key} is {row[key]!r}; give a number, or leave the point out")
    return value
