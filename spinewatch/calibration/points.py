"""Image points: what one camera sees of a control field, in one shot of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.calibration.errors import PointsError
from spinewatch.camera import Camera


@dataclass(frozen=True)
class Sensor:
    """What is known of a camera before it is calibrated: image size (W, H) and pixel size (px, py) in mm."""

    image_size_px: tuple[int, int]
    pixel_size_mm: tuple[float, float]

    @classmethod
    def of_cart(cls, image_size_px: tuple[int, int], aspect: float = 0.845) -> Sensor:
        """Return the cart's sensor at another resolution: 5.68 mm wide, pixels of the given aspect (eq. 3.5)."""
        px = 0.01 * 568 / image_size_px[0]
        return cls(image_size_px, (px, aspect * px))

    def camera(
        self,
        position_mm: tuple[float, float, float] = (0.0, 0.0, 0.0),
        rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
        focal_length_mm: float = 1.0,
        principal_point_mm: tuple[float, float] = (0.0, 0.0),
        radial: tuple[float, float] = (0.0, 0.0),
    ) -> Camera:
        """Return a camera with this sensor."""
        return Camera(
            position_mm,
            rotation_deg,
            focal_length_mm,
            principal_point_mm,
            radial,
            (0.0, 0.0),
            self.image_size_px,
            self.pixel_size_mm,
        )

    @property
    def plate_mm(self) -> Float:
        """Width and height (2,) of the plate, mm."""
        return np.asarray(np.array(self.image_size_px, dtype=np.float64) * self.pixel_size_mm)


@dataclass(frozen=True, eq=False)
class ImagePoints:
    """Control points seen in one image.

    ``ids`` (n); ``control_mm`` (n, 3) in the frame of the board; ``pixels`` (n, 2); ``sd_px`` (n,) relative
    standard deviation per coordinate. Raises ``PointsError`` for numbers that are not finite or ids or pixels
    that occur twice.
    """

    ids: tuple[str, ...]
    control_mm: Float
    pixels: Float
    sd_px: Float

    def __post_init__(self) -> None:
        for id_, xyz, uv in zip(self.ids, self.control_mm, self.pixels, strict=True):
            if not (np.all(np.isfinite(xyz)) and np.all(np.isfinite(uv))):
                raise PointsError(
                    f"point {id_} has a coordinate that is not a number; measure it again or leave it out"
                )
        if len(set(self.ids)) < len(self.ids):
            double = next(id_ for id_ in self.ids if self.ids.count(id_) > 1)
            raise PointsError(f"point {double} is given twice for one image; keep one of the two")
        for what, rows in (("pixel", self.pixels), ("control", self.control_mm)):
            _, first, count = np.unique(rows, axis=0, return_index=True, return_counts=True)
            if np.any(count > 1):
                id_ = self.ids[int(first[count > 1][0])]
                raise PointsError(
                    f"point {id_} has the same {what} coordinates as another; correct one of the two"
                )

    @classmethod
    def build(
        cls, ids: Sequence[str], control_mm: Float, pixels: Float, sd_px: Float | float = 1.0
    ) -> ImagePoints:
        """Return image points of arrays, with one standard deviation for all or one each."""
        n = len(ids)
        return cls(
            tuple(ids),
            np.ascontiguousarray(control_mm, dtype=np.float64).reshape(n, 3),
            np.ascontiguousarray(pixels, dtype=np.float64).reshape(n, 2),
            np.broadcast_to(np.asarray(sd_px, dtype=np.float64), (n,)).copy(),
        )

    def __len__(self) -> int:
        return len(self.ids)

    def keep(self, mask: NDArray[np.bool_]) -> ImagePoints:
        """Return the points where ``mask`` (n,) holds."""
        ids = tuple(id_ for id_, kept in zip(self.ids, mask, strict=True) if kept)
        return ImagePoints(ids, self.control_mm[mask], self.pixels[mask], self.sd_px[mask])


@dataclass(frozen=True, eq=False)
class Shot:
    """One stereo pair of a control field: its ``name``, and what the left and the right camera see."""

    name: str
    left: ImagePoints
    right: ImagePoints


def flatness(points_mm: Float) -> float:
    """Return how flat points (n, 3) lie: their least over their middle principal extent, 0 in a plane."""
    s = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)
    return float(s[2] / s[1]) if len(s) == 3 and s[1] > 1e-12 * s[0] else 0.0


def refuse_contradictions(images: Iterable[tuple[str, ImagePoints]]) -> None:
    """Raise ``PointsError`` when a point has other object coordinates in one named image than in another."""
    first: dict[str, tuple[str, list[float]]] = {}
    for name, image in images:
        for id_, xyz in zip(image.ids, image.control_mm.tolist(), strict=True):
            other, known = first.setdefault(id_, (name, xyz))
            if known != xyz:
                raise PointsError(
                    f"point {id_} has other object coordinates in {name} than in {other}; correct one of the two"
                )
