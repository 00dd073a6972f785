"""Image points of a control field, the sensor that took them, and the stereo pairs they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.calibration.errors import PointsError
from spinewatch.camera import Camera

_CART_WIDTH_MM = 5.68


@dataclass(frozen=True)
class Sensor:
    """What is given of a camera before its calibration.

    Attributes
    ----------
    image_size_px
        (W, H), px.
    pixel_size_mm
        (px, py), width and height of a pixel on the plate, mm.
    """

    image_size_px: tuple[int, int]
    pixel_size_mm: tuple[float, float]

    @classmethod
    def of_cart(cls, image_size_px: tuple[int, int], aspect: float = 0.845) -> Sensor:
        """Return the sensor of the 1995 cart at a given resolution: 5.68 mm wide.

        Parameters
        ----------
        image_size_px
            (W, H), px.
        aspect
            py/px.

        Returns
        -------
        Sensor
            The sensor.

        References
        ----------
        Thesis eq. 3.5.

        Examples
        --------
        >>> Sensor.of_cart((568, 416)).pixel_size_mm
        (0.01, 0.00845)
        """
        px = _CART_WIDTH_MM / image_size_px[0]
        return cls(image_size_px, (px, aspect * px))

    @classmethod
    def of_camera(cls, camera: Camera) -> Sensor:
        """Return the sensor of a camera.

        Parameters
        ----------
        camera
            The camera.

        Returns
        -------
        Sensor
            Its image size and pixel size.
        """
        return cls(camera.image_size_px, camera.pixel_size_mm)

    def camera(
        self,
        position_mm: tuple[float, float, float] = (0.0, 0.0, 0.0),
        rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
        focal_length_mm: float = 1.0,
        principal_point_mm: tuple[float, float] = (0.0, 0.0),
        radial: tuple[float, float] = (0.0, 0.0),
    ) -> Camera:
        """Return a camera with this sensor and no decentering distortion.

        Parameters
        ----------
        position_mm
            Perspective centre, object space, mm.
        rotation_deg
            (omega, phi, kappa), degrees.
        focal_length_mm
            f, mm.
        principal_point_mm
            (x0, y0) on the plate, mm.
        radial
            K1 per mm^2, K2 per mm^4.

        Returns
        -------
        Camera
            The camera.
        """
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
        """Width and height of the plate, shape (2,), mm."""
        return np.asarray(np.array(self.image_size_px, dtype=np.float64) * self.pixel_size_mm)


@dataclass(frozen=True, eq=False)
class ImagePoints:
    """Control points measured in one image.

    Attributes
    ----------
    ids
        Names of the n control points.
    control_mm
        Object coordinates, shape (n, 3), frame of the board, mm.
    pixels
        Image coordinates (u, v), shape (n, 2), px.
    sd_px
        Standard deviations per image coordinate, shape (n,), px; only their ratios matter.

    Raises
    ------
    PointsError
        If a coordinate is not finite, or ids, pixels or object coordinates occur twice.
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
        for kind, coordinates in (("pixel", self.pixels), ("control", self.control_mm)):
            _, first, count = np.unique(coordinates, axis=0, return_index=True, return_counts=True)
            if np.any(count > 1):
                id_ = self.ids[int(first[count > 1][0])]
                raise PointsError(
                    f"point {id_} has the same {kind} coordinates as another; correct one of the two"
                )

    @classmethod
    def build(
        cls, ids: Sequence[str], control_mm: Float, pixels: Float, sd_px: Float | float = 1.0
    ) -> ImagePoints:
        """Return image points of arrays.

        Parameters
        ----------
        ids
            Names of the n control points.
        control_mm
            Object coordinates, shape (n, 3), mm.
        pixels
            Image coordinates, shape (n, 2), px.
        sd_px
            Standard deviation per image coordinate, px: one for all or shape (n,).

        Returns
        -------
        ImagePoints
            The points, in double precision.
        """
        n = len(ids)
        return cls(
            tuple(ids),
            np.ascontiguousarray(control_mm, dtype=np.float64).reshape(n, 3),
            np.ascontiguousarray(pixels, dtype=np.float64).reshape(n, 2),
            np.broadcast_to(np.asarray(sd_px, dtype=np.float64), (n,)).copy(),
        )

    def __len__(self) -> int:
        return len(self.ids)

    def keep(self, mask: Bool) -> ImagePoints:
        """Return a selection of the points.

        Parameters
        ----------
        mask
            Which points to keep, shape (n,).

        Returns
        -------
        ImagePoints
            The points where the mask holds, in the same order.
        """
        ids = tuple(id_ for id_, kept in zip(self.ids, mask, strict=True) if kept)
        return ImagePoints(ids, self.control_mm[mask], self.pixels[mask], self.sd_px[mask])


@dataclass(frozen=True, eq=False)
class Shot:
    """One stereo pair of a control field.

    Attributes
    ----------
    name
        Name of the shot.
    left, right
        Control points in the image of each camera.
    """

    name: str
    left: ImagePoints
    right: ImagePoints

    @property
    def images(self) -> tuple[ImagePoints, ImagePoints]:
        """The image points of both sides, left first."""
        return self.left, self.right


def flatness(points_mm: Float) -> float:
    """Return the relief of points relative to their breadth.

    Parameters
    ----------
    points_mm
        Points, shape (n, 3), mm.

    Returns
    -------
    float
        Smallest over middle principal extent: 0 for points in a plane or on a line.

    Examples
    --------
    >>> import numpy as np
    >>> flatness(np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [10, 10, 0]]))
    0.0
    """
    s = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)
    return float(s[2] / s[1]) if len(s) == 3 and s[1] > 1e-12 * s[0] else 0.0


def check_consistent(images: Iterable[tuple[str, ImagePoints]]) -> None:
    """Check that a point has the same object coordinates in all images.

    Parameters
    ----------
    images
        Name and image points of each image.

    Raises
    ------
    PointsError
        If object coordinates of a point differ between two images.
    """
    known: dict[str, tuple[str, list[float]]] = {}
    for name, image in images:
        for id_, xyz in zip(image.ids, image.control_mm.tolist(), strict=True):
            other, first = known.setdefault(id_, (name, xyz))
            if first != xyz:
                raise PointsError(
                    f"point {id_} has other object coordinates in {name} than in {other}; correct one of the two"
                )
