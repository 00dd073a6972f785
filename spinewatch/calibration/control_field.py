"""Control fields: points of known object coordinates (Table 3.2), and the rule by which a board is designed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ControlFieldError

LOW_MM = (0.0, 15.0, 30.0, 45.0)
"""Heights of the LOW pegs of section 3.3, mm."""

HIGH_MM = (60.0, 75.0, 90.0, 105.0)
"""Heights of the HIGH pegs of section 3.3, mm."""

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
    """Control points in the frame of their board: right-handed, Z up towards the cameras.

    Attributes
    ----------
    name
        Name of the field.
    ids
        Names of the n points.
    points_mm
        Object coordinates, shape (n, 3), mm.

    Raises
    ------
    ControlFieldError
        If the field is empty, a coordinate is not finite, or ids or coordinates occur twice.
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
        double = next((id_ for id_ in self.ids if self.ids.count(id_) > 1), None)
        if double is not None:
            raise ControlFieldError(
                f"control field {self.name!r} lists point {double} twice; remove one of the two lines"
            )
        _check_distinct(self)

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, ids: Sequence[str]) -> Float:
        """Return the coordinates of points by name.

        Parameters
        ----------
        ids
            Names of m points.

        Returns
        -------
        Float
            Object coordinates in the order of the names, shape (m, 3), mm.

        Raises
        ------
        ControlFieldError
            If the field has no point of that name.
        """
        index = {id_: i for i, id_ in enumerate(self.ids)}
        unknown = [id_ for id_ in ids if id_ not in index]
        if unknown:
            raise ControlFieldError(
                f"control field {self.name!r} has no point {unknown[0]}; give the field that was photographed"
            )
        return np.asarray(self.points_mm[[index[id_] for id_ in ids]].reshape(-1, 3))


def pegboard_1995() -> ControlField:
    """Return the constructed peg board of the thesis: 5 rows of 6 pegs, point 1 at the far left corner.

    Returns
    -------
    ControlField
        30 points.

    References
    ----------
    Thesis Table 3.2.

    Examples
    --------
    >>> pegboard_1995().take(["1", "9"]).tolist()
    [[0.0, 508.0, 0.0], [254.0, 381.0, 104.902]]
    """
    return _grid("pegboard-1995", np.array(_PEG_HEIGHTS_MM), _PEG_SPACING_MM)


BUILT_IN_FIELDS: Mapping[str, Callable[[], ControlField]] = {"pegboard-1995": pegboard_1995}
"""Control fields that come with the library, by name."""


def built_in_field(name: str) -> ControlField:
    """Return a control field that comes with the library.

    Parameters
    ----------
    name
        A key of `BUILT_IN_FIELDS`.

    Returns
    -------
    ControlField
        The field.

    Raises
    ------
    ControlFieldError
        If there is no field of that name.
    """
    if name not in BUILT_IN_FIELDS:
        raise ControlFieldError(
            f"{name!r} is no built-in control field; choose from {', '.join(BUILT_IN_FIELDS)}, or give a CSV"
            " id,x_mm,y_mm,z_mm"
        )
    return BUILT_IN_FIELDS[name]()


def low_high_field(rows: int, columns: int, spacing_mm: float, rng: np.random.Generator) -> ControlField:
    """Return a board on which neighbours of a LOW peg are HIGH and the reverse.

    Heights are drawn from `LOW_MM` and `HIGH_MM`. Pegs on the rim are LOW, so that they occlude nothing in either
    image; LOW and HIGH alternate inside like the fields of a checkerboard.

    Parameters
    ----------
    rows, columns
        Number of rows and columns of pegs, at least 3.
    spacing_mm
        Distance of neighbouring pegs, mm.
    rng
        Source of the heights.

    Returns
    -------
    ControlField
        rows x columns points, numbered by row from the far left corner.

    Raises
    ------
    ControlFieldError
        If the board is smaller than 3 x 3 or the spacing is not positive.

    References
    ----------
    Thesis section 3.3.
    """
    if rows < 3 or columns < 3 or not spacing_mm > 0:
        raise ControlFieldError(
            f"a LOW/HIGH board of {rows} x {columns} pegs, {spacing_mm:g} mm apart, cannot be designed; give at least"
            " 3 rows, 3 columns and a positive spacing"
        )
    r, c = np.indices((rows, columns))
    rim = (r == 0) | (r == rows - 1) | (c == 0) | (c == columns - 1)
    high = ((r + c) % 2 == 1) & ~rim
    heights = np.where(high, rng.choice(HIGH_MM, (rows, columns)), rng.choice(LOW_MM, (rows, columns)))
    return _grid(f"low-high-{rows}x{columns}", heights, spacing_mm)


def _check_distinct(field: ControlField) -> None:
    _, first, count = np.unique(field.points_mm, axis=0, return_index=True, return_counts=True)
    if np.any(count > 1):
        i = int(first[count > 1][0])
        same = np.nonzero((field.points_mm == field.points_mm[i]).all(axis=1))[0]
        raise ControlFieldError(
            f"control points {field.ids[same[0]]} and {field.ids[same[1]]} have the same coordinates; correct one"
        )


def _grid(name: str, heights: Float, spacing_mm: float) -> ControlField:
    """Return a field of pegs on a square grid, from their heights (rows, columns)."""
    rows, columns = heights.shape
    r, c = np.indices((rows, columns))
    points = np.stack([c * spacing_mm, (rows - 1 - r) * spacing_mm, heights], axis=-1).reshape(-1, 3)
    return ControlField(name, tuple(str(i + 1) for i in range(rows * columns)), points.astype(np.float64))
