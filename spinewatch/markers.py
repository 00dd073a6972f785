"""Markers as data: balls in the marker's own frame, and the distances between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.errors import ParameterError
from spinewatch.numbers import parse_number

BALL_DIAMETER_MM = 8.0
"""Diameter of the balls of a marker that is described by a text."""

_FLAT_VOLUME_MM3 = 1.0
"""Four balls whose determinant is smaller than this lie in a plane."""

_MIN_EXTENT_MM = 1.0
"""Three balls whose second principal extent is smaller than this lie on a line."""

_MAX_LEG_MM = 500.0
"""Longest leg of a marker that is described by a text."""

_MIN_DISTANCE_DIFFERENCE_MM = 1.0
"""Distances of a marker of three balls must differ by this much to identify the balls."""


@dataclass(frozen=True, eq=False)
class TriadModel:
    """A marker of three or four balls in its own frame: origin P, z towards the cameras.

    Attributes
    ----------
    name
        Name of the marker.
    balls
        Names of the n balls, in the order of the coordinates.
    coordinates_mm
        Centres of the balls, shape (n, 3), marker frame, mm.
    ball_diameter_mm
        Diameter of every ball, mm.

    Raises
    ------
    ParameterError
        If there are not three or four balls, if they lie on one line, or if two distances between three balls are
        equal.

    References
    ----------
    Thesis fig. 5.6 and Table 5.3. Markers of four balls are not in the thesis.
    """

    name: str
    balls: tuple[str, ...]
    coordinates_mm: Float
    ball_diameter_mm: float

    def __post_init__(self) -> None:
        n = len(self.balls)
        if n not in (3, 4) or self.coordinates_mm.shape != (n, 3) or len(set(self.balls)) != n:
            raise ParameterError(
                f"marker {self.name!r} does not have three or four balls with different names and three coordinates"
                " each; correct its definition"
            )
        if np.linalg.svd(self.coordinates_mm - self.coordinates_mm.mean(axis=0))[1][1] < _MIN_EXTENT_MM:
            raise ParameterError(f"the balls of marker {self.name!r} lie on a line; move one aside")
        if n == 3 and np.diff(np.sort(self.distances_mm)).min() < _MIN_DISTANCE_DIFFERENCE_MM:
            raise ParameterError(
                f"two distances of marker {self.name!r} are equal, so that its balls cannot be identified; make all"
                " three different"
            )

    @cached_property
    def pairs(self) -> Int:
        """Ball pairs of `distances_mm`, shape (d, 2): 0-1, 0-2, 1-2 for three balls."""
        return np.array(list(combinations(range(len(self.balls)), 2)), dtype=np.intp)

    @cached_property
    def distances_mm(self) -> Float:
        """Distances between the balls of each pair, shape (d,), mm: the reference distance matrix (Table 5.3)."""
        a, b = self.coordinates_mm[self.pairs.T]
        return np.asarray(np.linalg.norm(a - b, axis=1))

    @cached_property
    def chirality(self) -> int:
        """Sign of the volume spanned by four balls; 0 for balls in a plane, which equal their mirror image."""
        return int(_volume_signs(self.coordinates_mm))

    def matches_chirality(self, balls_mm: Float) -> Bool:
        """Return whether measured balls are not the mirror image of the marker.

        Parameters
        ----------
        balls_mm
            Balls in the order of the model, shape (..., n, 3), mm.

        Returns
        -------
        Bool
            False for the mirror image of four balls that span a volume, otherwise true, shape (...).
        """
        if not self.chirality:
            return np.ones(balls_mm.shape[:-2], dtype=bool)
        return np.asarray(_volume_signs(balls_mm) == self.chirality)

    def without(self, ball: int) -> TriadModel | None:
        """Return the marker of three balls that remains of a marker of four.

        Parameters
        ----------
        ball
            Index of the ball to leave out.

        Returns
        -------
        TriadModel or None
            The other balls in the same frame; None if their distances do not identify them.
        """
        kept = [k for k in range(len(self.balls)) if k != ball]
        try:
            return TriadModel(
                self.name,
                tuple(self.balls[k] for k in kept),
                self.coordinates_mm[kept],
                self.ball_diameter_mm,
            )
        except ParameterError:
            return None


def flat_triad(
    xx_mm: float = 18.0, yy_mm: float = 14.0, mx_mm: float = 10.0, ball_diameter_mm: float = BALL_DIAMETER_MM
) -> TriadModel:
    """Return a flat marker: XX, P and MX on a line, YY beside it.

    Parameters
    ----------
    xx_mm, yy_mm, mx_mm
        Lengths of the legs from P to the balls, mm.
    ball_diameter_mm
        Diameter of the balls, mm.

    Returns
    -------
    TriadModel
        Marker with the balls XX, YY and MX.

    References
    ----------
    Thesis fig. 5.6.

    Examples
    --------
    >>> flat_triad().distances_mm.round(1)
    array([22.8, 28. , 17.2])
    """
    return TriadModel(
        name=f"flat-{mx_mm:g}-{yy_mm:g}-{xx_mm:g}",
        balls=("XX", "YY", "MX"),
        coordinates_mm=np.array([[xx_mm, 0.0, 0.0], [0.0, -yy_mm, 0.0], [-mx_mm, 0.0, 0.0]]),
        ball_diameter_mm=ball_diameter_mm,
    )


def orthogonal_triad(
    xx_mm: float, yy_mm: float, zz_mm: float, ball_diameter_mm: float = BALL_DIAMETER_MM
) -> TriadModel:
    """Return a marker with balls at the ends of three perpendicular legs that meet in P.

    The origin is P, z is the normal of the plane of the balls on the side away from P, x is parallel to the line from
    ZZ to XX.

    Parameters
    ----------
    xx_mm, yy_mm, zz_mm
        Lengths of the legs, mm.
    ball_diameter_mm
        Diameter of the balls, mm.

    Returns
    -------
    TriadModel
        Marker with the balls XX, YY and ZZ.

    References
    ----------
    Thesis fig. 4.1, which does not give the lengths of the legs.
    """
    legs = np.diag([float(xx_mm), yy_mm, zz_mm])
    x, across = legs[0] - legs[2], legs[0] - legs[1]
    z = np.cross(x, across)
    z *= np.sign(z.sum()) / np.linalg.norm(z)
    x /= np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(z, x), z])
    return TriadModel(
        name=f"orthogonal-{xx_mm:g}-{yy_mm:g}-{zz_mm:g}",
        balls=("XX", "YY", "ZZ"),
        coordinates_mm=legs @ axes,
        ball_diameter_mm=ball_diameter_mm,
    )


def scaled(model: TriadModel, factor: float) -> TriadModel:
    """Return a marker with its distances multiplied by a factor.

    Parameters
    ----------
    model
        Marker to scale.
    factor
        Ratio of the new distances to the old ones.

    Returns
    -------
    TriadModel
        The scaled marker; its balls keep their diameter.
    """
    return TriadModel(
        f"{model.name}x{factor:g}", model.balls, model.coordinates_mm * factor, model.ball_diameter_mm
    )


FLAT_10_14_18 = flat_triad()
"""The flat marker of fig. 5.6; Table 5.3 rounds its distances to 22.8, 28.0 and 17.2 mm."""

MODELS: Mapping[str, TriadModel] = {FLAT_10_14_18.name: FLAT_10_14_18}
"""Markers by name."""

KINDS: Mapping[str, Callable[[float, float, float], TriadModel]] = {
    "flat": flat_triad,
    "orthogonal": orthogonal_triad,
}
"""Markers by the kind of their legs: how a text of each is made a marker, from its three lengths, mm."""


def marker(name: str) -> TriadModel:
    """Return a known marker by its name.

    Parameters
    ----------
    name
        A key of `MODELS`.

    Returns
    -------
    TriadModel
        The marker.

    Raises
    ------
    ParameterError
        If no marker has this name.

    Examples
    --------
    >>> marker("flat-10-14-18").balls
    ('XX', 'YY', 'MX')
    """
    if name not in MODELS:
        raise ParameterError(f"marker {name!r} is not known; use one of: {', '.join(sorted(MODELS))}")
    return MODELS[name]


def parse_marker(text: str) -> TriadModel:
    """Return the marker of a text.

    Parameters
    ----------
    text
        A key of `MODELS`, or ``flat:XX,YY,MX`` or ``orthogonal:XX,YY,ZZ`` with the lengths of the legs, mm.

    Returns
    -------
    TriadModel
        The marker.

    Raises
    ------
    ParameterError
        If no marker has this name, the lengths are not three positive numbers, or its balls cannot be identified.

    Examples
    --------
    >>> parse_marker("flat:18,14,10").name
    'flat-10-14-18'
    """
    kind, separator, legs = text.partition(":")
    if not separator:
        return marker(text)
    if kind not in KINDS:
        raise ParameterError(
            f"marker {text!r} is none of {', '.join(sorted(MODELS))}, flat:... or orthogonal:..."
        )
    try:
        xx, yy, third = (parse_number(length) for length in legs.split(","))
    except ValueError as error:
        raise ParameterError(f"marker {text!r} must have 3 numbers, like {kind}:18,14,10") from error
    if not all(0 < length <= _MAX_LEG_MM for length in (xx, yy, third)):
        raise ParameterError(f"marker {text!r} must have lengths above 0 and up to {_MAX_LEG_MM:g} mm")
    try:
        return KINDS[kind](xx, yy, third)
    except ParameterError as error:
        if max(xx, yy, third) >= BALL_DIAMETER_MM:
            raise
        raise ParameterError(
            f"marker {text!r} is smaller than a ball; give the lengths of its legs in mm, not in cm or m"
        ) from error


def _volume_signs(balls_mm: Float) -> Float:
    """Return the signs of the volumes spanned by balls (..., n, 3), shape (...); 0 for three balls or a plane."""
    if balls_mm.shape[-2] < 4:
        return np.zeros(balls_mm.shape[:-2])
    volume = np.linalg.det(balls_mm[..., 1:4, :] - balls_mm[..., :1, :])
    return np.asarray(np.sign(volume) * (np.abs(volume) > _FLAT_VOLUME_MM3))
