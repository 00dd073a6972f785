"""The triad marker as data: three balls on legs, and the distances between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinewatch.camera import Float


@dataclass(frozen=True, eq=False)
class TriadModel:
    """Three balls in the triad's frame: origin P, x from MX to XX, z the normal that faces the cameras.

    ``balls`` names the rows of ``coordinates_mm`` (3, 3); ``ball_diameter_mm`` is the same for all.
    """

    name: str
    balls: tuple[str, str, str]
    coordinates_mm: Float
    ball_diameter_mm: float

    @cached_property
    def distances_mm(self) -> Float:
        """Distances (3,) of the ball pairs 0-1, 0-2, 1-2, mm: the reference distance matrix (Table 5.3)."""
        a, b, c = self.coordinates_mm
        return np.array([np.linalg.norm(a - b), np.linalg.norm(a - c), np.linalg.norm(b - c)])


FLAT_10_14_18 = TriadModel(
    name="flat-10-14-18",
    balls=("XX", "YY", "MX"),
    coordinates_mm=np.array([[18.0, 0.0, 0.0], [0.0, -14.0, 0.0], [-10.0, 0.0, 0.0]]),
    ball_diameter_mm=8.0,
)
"""The flat marker of fig. 5.6; its legs give the distances that Table 5.3 rounds to 22.8, 28.0, 17.2 mm."""
