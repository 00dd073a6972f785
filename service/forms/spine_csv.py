"""Vertebra poses as CSV: one row per vertebra; each error names its row and column."""

from __future__ import annotations

import csv
import io
from typing import Literal

from pydantic import ValidationError

from contract.setup_checks import SpineSetupError
from contract.spine_setup import POSITION_SD_MM, ROTATION_SD_DEG, InitialPoses, VertebraPose
from spinewatch.numbers import NumberTextError, parse_number

REQUIRED = ("vertebra", "x_mm", "y_mm", "z_mm", "coronal_deg", "sagittal_deg", "axial_deg")
OPTIONAL = ("position_sd_mm", "rotation_sd_deg")
_MAX_ROWS = 30
_MAX_BYTES = 2**16


def parse_poses(content: bytes, frame: Literal["object", "patient"]) -> InitialPoses:
    """Return the initial configuration in a CSV file with the columns ``REQUIRED``, and ``OPTIONAL`` if known.

    Raises ``SpineSetupError`` for a file that is no such table.
    """
    if len(content) > _MAX_BYTES:
        raise _error((), f"the file is larger than {_MAX_BYTES} bytes; give one row per vertebra")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _error((), "the file is not text in UTF-8; save it as CSV in UTF-8") from error
    try:
        rows = [
            row for row in csv.reader(io.StringIO(text), strict=True) if any(cell.strip() for cell in row)
        ]
    except csv.Error as error:
        raise _error((), "the file is not CSV with commas; save it as CSV") from error
    if not rows:
        raise _error((), f"the file is empty; its first row is {','.join(REQUIRED)}")
    header = [name.strip() for name in rows[0]]
    missing = [name for name in REQUIRED if name not in header]
    unknown = [name for name in header if name not in (*REQUIRED, *OPTIONAL)]
    if missing or unknown or len(set(header)) < len(header):
        raise _error(
            (1,), f"the first row must be {','.join(REQUIRED)}, and may add {','.join(OPTIONAL)}; each once"
        )
    if not 2 <= len(rows) - 1 <= _MAX_ROWS:
        raise _error((), f"there are {len(rows) - 1} vertebrae; give 2 to {_MAX_ROWS}")
    poses = [_pose(number, header, row) for number, row in enumerate(rows[1:], start=2)]
    return InitialPoses(kind="poses", frame=frame, poses=poses)


def _pose(number: int, header: list[str], row: list[str]) -> VertebraPose:
    if len(row) != len(header):
        raise _error((number,), f"the row has {len(row)} cells and the first row {len(header)}; complete it")
    cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
    numbers = {
        name: _number((number, name), cell)
        for name, cell in cells.items()
        if name != "vertebra" and (cell or name in REQUIRED)
    }
    try:
        return VertebraPose(
            vertebra=cells["vertebra"],
            position_mm=[numbers[f"{axis}_mm"] for axis in "xyz"],
            angles_deg=[numbers[f"{angle}_deg"] for angle in ("coronal", "sagittal", "axial")],
            position_sd_mm=numbers.get("position_sd_mm", POSITION_SD_MM),
            rotation_sd_deg=numbers.get("rotation_sd_deg", ROTATION_SD_DEG),
        )
    except ValidationError as error:
        column = str(error.errors()[0]["loc"][0])
        raise _error((number, column), error.errors()[0]["msg"]) from error


def _number(place: tuple[int, str], cell: str) -> float:
    try:
        return parse_number(cell)
    except NumberTextError as error:
        raise _error(place, f"this {error}; write digits with a decimal point") from error


def _error(place: tuple[str | int, ...], problem: str) -> SpineSetupError:
    """Return the error of a row, counted from 1 with the header, and a column."""
    named = tuple(f"row {part}" if isinstance(part, int) else part for part in place)
    return SpineSetupError(("csv", *named), problem, "invalid-csv")
