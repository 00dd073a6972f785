"""Markers as data: balls in a frame of their own, and the distances between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError

_FLAT_VOLUME_MM3 = 1.0
_LEAST_DIFFERENCE_MM = 1.0


@dataclass(frozen=True, eq=False)
class TriadModel:
    """A marker of three or four balls in its own frame: origin P, z the direction that faces the cameras.

    ``balls`` names the rows of ``coordinates_mm`` (n, 3); ``ball_diameter_mm`` is the same for all. Raises
    ``ParameterError`` for another number of balls, for balls on a line, and for a marker that looks the same
    after a change of balls: two of its distances, for three balls, or its whole distance matrix.
    """

    name: str
    balls: tuple[str, ...]
    coordinates_mm: Float
    ball_diameter_mm: float

    def __post_init__(self) -> None:
        n = len(self.balls)
        if n not in (3, 4) or self.coordinates_mm.shape != (n, 3) or len(set(self.balls)) != n:
            raise ParameterError(
                f"marker {self.name!r} must have three or four named balls with three numbers"
            )
        if np.linalg.svd(self.coordinates_mm - self.coordinates_mm.mean(axis=0))[1][1] < 1.0:
            raise ParameterError(f"the balls of marker {self.name!r} lie on a line; move one aside")
        if n == 3 and np.diff(np.sort(self.distances_mm)).min() < _LEAST_DIFFERENCE_MM:
            raise ParameterError(
                f"two distances of marker {self.name!r} are equal, so that its balls cannot be told apart; "
                "make all three different"
            )

    @cached_property
    def pairs(self) -> NDArray[np.intp]:
        """The ball pairs (d, 2) that ``distances_mm`` lists: 0-1, 0-2, 1-2 for three balls."""
        return np.array(list(combinations(range(len(self.balls)), 2)), dtype=np.intp)

    @cached_property
    def distances_mm(self) -> Float:
        """Distances (d,) of the ball ``pairs``, mm: the reference distance matrix (Table 5.3)."""
        a, b = self.coordinates_mm[self.pairs.T]
        return np.asarray(np.linalg.norm(a - b, axis=1))

    @cached_property
    def chirality(self) -> int:
        """Sign of the volume that four balls span; 0 for a flat marker, which its mirror image equals."""
        return int(_signs(self.coordinates_mm))

    def same_hand(self, balls_mm: Float) -> NDArray[np.bool_]:
        """Return (...,) whether measured balls (..., n, 3) are not the mirror image of four that span a volume."""
        if not self.chirality:
            return np.ones(balls_mm.shape[:-2], dtype=bool)
        return np.asarray(_signs(balls_mm) == self.chirality)

    def without(self, ball: int) -> TriadModel | None:
        """Return the marker of four balls without one, in the same frame; None if three cannot be told apart."""
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
    xx_mm: float = 18.0, yy_mm: float = 14.0, mx_mm: float = 10.0, ball_diameter_mm: float = 8.0
) -> TriadModel:
    """Return the flat marker of fig. 5.6 with legs of other lengths: XX, P and MX in line, YY beside them."""
    return TriadModel(
        name=f"flat-{mx_mm:g}-{yy_mm:g}-{xx_mm:g}",
        balls=("XX", "YY", "MX"),
        coordinates_mm=np.array([[xx_mm, 0.0, 0.0], [0.0, -yy_mm, 0.0], [-mx_mm, 0.0, 0.0]]),
        ball_diameter_mm=ball_diameter_mm,
    )


def orthogonal_triad(xx_mm: float, yy_mm: float, zz_mm: float, ball_diameter_mm: float = 8.0) -> TriadModel:
    """Return the early marker of fig. 4.1: balls at the ends of three legs at right angles that meet in P.

    Its legs' lengths are not printed in the thesis. The frame has its origin in P, z along the normal of the
    plane of the balls, which is taken to face the cameras, and x parallel to the line from ZZ to XX.
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
    """Return the marker with every distance, but not its balls, multiplied."""
    return TriadModel(
        f"{model.name}x{factor:g}", model.balls, model.coordinates_mm * factor, model.ball_diameter_mm
    )


FLAT_10_14_18 = flat_triad()
"""The flat marker of fig. 5.6; its legs give the distances that Table 5.3 rounds to 22.8, 28.0, 17.2 mm."""

MODELS: Mapping[str, TriadModel] = {FLAT_10_14_18.name: FLAT_10_14_18}
"""Markers that are known by name."""


def _signs(balls_mm: Float) -> Float:
    if balls_mm.shape[-2] < 4:
        return np.zeros(balls_mm.shape[:-2])
    volume = np.linalg.det(balls_mm[..., 1:4, :] - balls_mm[..., :1, :])
    return np.asarray(np.sign(volume) * (np.abs(volume) > _FLAT_VOLUME_MM3))
