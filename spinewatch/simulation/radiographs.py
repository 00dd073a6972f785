"""Simulated PA and lateral radiographs of a spine of known poses: the landmarks that would be digitized on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.spine.radiograph_landmarks import CommonPoint, LandmarkedVertebra, RadiographView


@dataclass(frozen=True)
class FilmParameters:
    """Views, shape of the vertebrae and common points of simulated radiographs.

    Attributes
    ----------
    pa, lateral
        The views.
    pa_centre_px, lateral_centre_px
        Where the origin of the patient axes appears (u, v), px.
    body_height_mm
        Distance of the end plates, mm.
    end_plate_radius_mm
        Radius of the round end plates, mm.
    pedicle_spacing_mm
        Distance of the pedicles from each other, mm.
    pedicle_ratio
        That over twice their distance behind the centre of the body.
    pedicle_ratio_sd
        Standard deviation of the ratio between vertebrae.
    common_points
        Number of points that the cameras see too, on both sides of the spine.
    object_sd_mm
        Standard deviation of these in object space, per axis, mm.
    """

    pa: RadiographView = field(default_factory=lambda: RadiographView((0.20, 0.20), "left"))
    lateral: RadiographView = field(default_factory=lambda: RadiographView((0.20, 0.20), "right"))
    pa_centre_px: tuple[float, float] = (1100.0, 3500.0)
    lateral_centre_px: tuple[float, float] = (1150.0, 3200.0)
    body_height_mm: float = 25.0
    end_plate_radius_mm: float = 20.0
    pedicle_spacing_mm: float = 25.0
    pedicle_ratio: float = 0.70
    pedicle_ratio_sd: float = 0.10
    common_points: int = 8
    object_sd_mm: float = 0.3

    def pa_px(self, points_mm: Float) -> Float:
        """Return where the PA view shows points.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), patient axes, mm.

        Returns
        -------
        Float
            Pixels (u, v), shape (..., 2).
        """
        return _shown(self.pa, points_mm[..., [1, 2]], self.pa_centre_px)

    def lateral_px(self, points_mm: Float) -> Float:
        """Return where the lateral view shows points.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), patient axes, mm.

        Returns
        -------
        Float
            Pixels (u, v), shape (..., 2).
        """
        return _shown(self.lateral, points_mm[..., [0, 2]], self.lateral_centre_px)


@dataclass(frozen=True, eq=False)
class RadiographScene:
    """A spine and what its radiographs show.

    Attributes
    ----------
    position_mm
        True centroids, shape (n, 3), object space, mm.
    rotation
        True rotations from vertebra to object axes, shape (n, 3, 3).
    vertebrae
        Landmarks of the vertebrae.
    common
        Common points, whose places in object space have errors.
    """

    position_mm: Float
    rotation: Float
    vertebrae: tuple[LandmarkedVertebra, ...]
    common: tuple[CommonPoint, ...]


def radiograph_scene(
    levels: Sequence[str],
    position_mm: Float,
    rotation: Float,
    object_from_patient: RigidTransform,
    rng: np.random.Generator,
    parameters: FilmParameters | None = None,
) -> RadiographScene:
    """Return the exact landmarks of a spine, and common points with their errors in object space.

    Parameters
    ----------
    levels
        Names of the vertebrae.
    position_mm
        Centroids, shape (n, 3), patient axes, mm.
    rotation
        Rotations from vertebra to patient axes, shape (n, 3, 3).
    object_from_patient
        Where the cameras see the patient.
    rng
        Source of random numbers.
    parameters
        Views and shapes; the default ones if None.

    Returns
    -------
    RadiographScene
        Truth and landmarks.
    """
    p = parameters or FilmParameters()
    ratios = p.pedicle_ratio + p.pedicle_ratio_sd * rng.standard_normal(len(levels))
    low = position_mm.min(axis=0) - np.array([60, 60, 10])
    high = position_mm.max(axis=0) + np.array([0, 60, 10])
    points = rng.uniform(low, high, (p.common_points, 3))
    places = object_from_patient(points) + p.object_sd_mm * rng.standard_normal(points.shape)
    covariance = p.object_sd_mm**2 * np.eye(3)
    return RadiographScene(
        position_mm=object_from_patient(position_mm),
        rotation=object_from_patient.rotation @ rotation,
        vertebrae=tuple(
            shown_vertebra(level, place, axes, float(ratio), p)
            for level, place, axes, ratio in zip(levels, position_mm, rotation, ratios, strict=True)
        ),
        common=tuple(
            CommonPoint(f"screw {number}", p.pa_px(point), p.lateral_px(point), place, covariance)
            for number, (point, place) in enumerate(zip(points, places, strict=True), start=1)
        ),
    )


def shown_vertebra(
    level: str,
    position_mm: Float,
    rotation: Float,
    pedicle_ratio: float,
    parameters: FilmParameters | None = None,
) -> LandmarkedVertebra:
    """Return the landmarks of one vertebra in both views, without error.

    The longest diameter of a round end plate that a view shows is perpendicular to the line of sight.

    Parameters
    ----------
    level
        Name of the vertebra.
    position_mm
        Centroid, shape (3,), patient axes, mm.
    rotation
        Rotation from vertebra to patient axes, shape (3, 3).
    pedicle_ratio
        W / (2 D) of its pedicles.
    parameters
        Views and shapes; the default ones if None.

    Returns
    -------
    LandmarkedVertebra
        The landmarks.
    """
    p = parameters or FilmParameters()
    up = rotation[:, 2]
    to_left, to_front = np.cross(up, [1.0, 0, 0]), np.cross([0.0, 1, 0], up)
    plates = position_mm + p.body_height_mm / 2 * np.array([up, -up])

    def ends(direction: Float) -> Float:
        radius = p.end_plate_radius_mm * direction / np.linalg.norm(direction)
        return np.concatenate([[plate + radius, plate - radius] for plate in plates])

    half = p.pedicle_spacing_mm / 2
    behind = half / pedicle_ratio
    pedicles = position_mm + np.array([[-behind, half, 0], [-behind, -half, 0]]) @ rotation.T
    return LandmarkedVertebra(level, p.pa_px(ends(to_left)), p.lateral_px(ends(to_front)), p.pa_px(pedicles))


def digitized(scene: RadiographScene, sd_px: float, rng: np.random.Generator) -> RadiographScene:
    """Return a scene whose landmarks have errors of digitizing.

    Parameters
    ----------
    scene
        Exact landmarks.
    sd_px
        Standard deviation of a landmark per axis, px.
    rng
        Source of random numbers.

    Returns
    -------
    RadiographScene
        The same truth with other landmarks.
    """

    def moved(points_px: Float) -> Float:
        return points_px + sd_px * rng.standard_normal(points_px.shape)

    return replace(
        scene,
        vertebrae=tuple(
            LandmarkedVertebra(
                v.level,
                moved(v.pa_px),
                moved(v.lateral_px),
                None if v.pedicles_px is None else moved(v.pedicles_px),
            )
            for v in scene.vertebrae
        ),
        common=tuple(replace(c, pa_px=moved(c.pa_px), lateral_px=moved(c.lateral_px)) for c in scene.common),
    )


def _shown(view: RadiographView, plane_mm: Float, centre_px: tuple[float, float]) -> Float:
    """Return pixels (..., 2) of points (towards left or front, up), mm, from the origin of the patient axes."""
    row, column = view.pixel_spacing_mm
    across = -column if view.positive_on == "left" else column
    return np.asarray(np.array(centre_px) + plane_mm / np.array([across, -row]))
