"""Control fields: points of known object coordinates (Table 3.2), and the rule to design one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ControlFieldError

LOW_MM = (0.0, 15.0, 30.0, 45.0)
HIGH_MM = (60.0, 75.0, 90.0, 105.0)

_PEG_SPACING_MM = 127.0
_PEG_HEIGHTS_MM = (
    (0.000, 44.780, 14.858, 44.754, 29.794, 59.893),
    (44.780, 14.884, 104.902, 29.921, 89.839, 14.732),
    (29.895, 0.000, 45.110, 120.192, 30.073, 44.856),
    (59.994, 45.059, 90.195, 44.983, 104.952, 0.000),
    (15.113, 60.248, 30.124, 44.932, 14.985, 59.918),
)


@dataclass(frozen=True, eq=False)
class ControlField:
    """Control points: ``ids`` (n) and ``points_mm`` (n, 3), right-handed, Z up towards the cameras.

    Raises ``ControlFieldError`` for points that are not finite, ids or places that occur twice, or none at all.
    """

    name: str
    ids: tuple[str, ...]
    points_mm: Float

    def __post_init__(self) -> None:
        if self.points_mm.shape != (len(self.ids), 3) or not self.ids:
            raise ControlFieldError(f"control field {self.name!r} has no points; give id, x, y and z of each")
        for id_, point in zip(self.ids, self.points_mm, strict=True):
            if not np.all(np.isfinite(point)):
                raise ControlFieldError(
                    f"control point {id_} has a coordinate that is not a number; measure it again"
                )
        refuse_doubles(
            self.ids, f"control field {self.name!r} lists point {{}} twice; remove one of the two lines"
        )
        _refuse_same_place(self)

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, ids: Sequence[str]) -> Float:
        """Return the coordinates (m, 3) of the points named; raises ``ControlFieldError`` for an unknown id."""
        row = {id_: i for i, id_ in enumerate(self.ids)}
        unknown = [id_ for id_ in ids if id_ not in row]
        if unknown:
            raise ControlFieldError(
                f"control field {self.name!r} has no point {unknown[0]}; give the field that was photographed"
            )
        return np.asarray(self.points_mm[[row[id_] for id_ in ids]].reshape(-1, 3))


def refuse_doubles(ids: Sequence[str], message: str) -> None:
    """Raise ``ControlFieldError`` with ``message`` formatted with the first id that occurs twice."""
    seen: set[str] = set()
    for id_ in ids:
        if id_ in seen:
            raise ControlFieldError(message.format(id_))
        seen.add(id_)


def _refuse_same_place(field: ControlField) -> None:
    _, first, count = np.unique(field.points_mm, axis=0, return_index=True, return_counts=True)
    if np.any(count > 1):
        i = int(first[count > 1][0])
        same = np.nonzero((field.points_mm == field.points_mm[i]).all(axis=1))[0]
        raise ControlFieldError(
            f"control points {field.ids[same[0]]} and {field.ids[same[1]]} have the same coordinates; correct one"
        )


def pegboard_1995() -> ControlField:
    """Return the constructed peg board of Table 3.2: 5 rows of 6 pegs, point 1 at the far left corner."""
    rows, columns = len(_PEG_HEIGHTS_MM), len(_PEG_HEIGHTS_MM[0])
    return _grid("pegboard-1995", np.array(_PEG_HEIGHTS_MM).reshape(rows, columns), _PEG_SPACING_MM)


BUILT_IN = {"pegboard-1995": pegboard_1995}


def low_high_field(rows: int, columns: int, spacing_mm: float, rng: np.random.Generator) -> ControlField:
    """Return a board designed by the rule of section 3.3: neighbours of a LOW peg are HIGH and the reverse.

    Heights are drawn from {0, 15, 30, 45} and {60, 75, 90, 105} mm; pegs on the rim are LOW, so that both
    cameras can see past them, and the checkerboard of LOW and HIGH fills the inside.
    """
    if rows < 3 or columns < 3 or not spacing_mm > 0:
        raise ControlFieldError("a LOW/HIGH board needs at least 3 rows, 3 columns and a positive spacing")
    r, c = np.indices((rows, columns))
    rim = (r == 0) | (r == rows - 1) | (c == 0) | (c == columns - 1)
    high = ((r + c) % 2 == 1) & ~rim
    heights = np.where(high, rng.choice(HIGH_MM, (rows, columns)), rng.choice(LOW_MM, (rows, columns)))
    return _grid(f"low-high-{rows}x{columns}", heights, spacing_mm)


def _grid(name: str, heights: Float, spacing_mm: float) -> ControlField:
    rows, columns = heights.shape
    r, c = np.indices((rows, columns))
    points = np.stack([c * spacing_mm, (rows - 1 - r) * spacing_mm, heights], axis=-1).reshape(-1, 3)
    return ControlField(name, tuple(str(i + 1) for i in range(rows * columns)), points.astype(np.float64))
