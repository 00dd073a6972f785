"""Errors of distances and angles against their size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.quality.accuracy import reconstruct
from spinewatch.calibration.solve.bundle import rms
from spinewatch.camera import Rig


@dataclass(frozen=True, eq=False)
class SizeAccuracy:
    """Errors of distances of about one size and of angles between legs of that length.

    Attributes
    ----------
    size_mm
        The size, mm.
    distance_rms_mm
        Root mean square error of distances, mm.
    angle_rms_deg
        Root mean square error of angles, degrees.
    n_angles
        Number of angles.
    """

    size_mm: float
    distance_rms_mm: float
    angle_rms_deg: float
    n_angles: int


def size_accuracy(
    residuals_mm: Sequence[Float],
    control_mm: Sequence[Float],
    edges_mm: Sequence[float],
    max_points: int = 60,
) -> list[SizeAccuracy]:
    """Return the errors of distances and angles between the control points, by size class.

    Parameters
    ----------
    residuals_mm
        Residuals of reconstructed control points of each shot, shape (n, 3), mm.
    control_mm
        Those control points, shape (n, 3), mm.
    edges_mm
        Limits of the size classes, mm. An angle is counted by its shorter leg.
    max_points
        Points of a shot that are used, evenly spread over them: the number of angles grows with its third power.

    Returns
    -------
    list of SizeAccuracy
        One per class that has distances and angles; its size is the middle of the class.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]])
    >>> (found,) = size_accuracy([0.01 * square], [square], [50.0, 120.0])
    >>> round(found.distance_rms_mm, 3), round(found.angle_rms_deg, 3), found.n_angles
    (1.0, 0.0, 12)
    """
    sizes, distance_errors, legs, angle_errors = ([np.empty(0)] for _ in range(4))
    for residual, points in zip(residuals_mm, control_mm, strict=True):
        some = np.unique(np.linspace(0, len(points) - 1, min(len(points), max_points)).round().astype(int))
        control = points[some]
        measured = control + residual[some]
        i, j = np.triu_indices(len(some), k=1)
        true = np.linalg.norm(control[i] - control[j], axis=1)
        sizes.append(true)
        distance_errors.append(np.linalg.norm(measured[i] - measured[j], axis=1) - true)
        i, j = np.triu_indices(len(some) - 1, k=1)
        for v in range(len(some)):
            first, second = i + (i >= v), j + (j >= v)
            to_first, to_second = control[first] - control[v], control[second] - control[v]
            legs.append(np.minimum(np.linalg.norm(to_first, axis=1), np.linalg.norm(to_second, axis=1)))
            found = _angles_deg(measured[first] - measured[v], measured[second] - measured[v])
            angle_errors.append(found - _angles_deg(to_first, to_second))
    size, distance, leg, angle = map(np.concatenate, (sizes, distance_errors, legs, angle_errors))
    out = []
    for low, high in pairwise(edges_mm):
        d, a = (size >= low) & (size < high), (leg >= low) & (leg < high)
        if d.any() and a.any():
            out.append(SizeAccuracy((low + high) / 2, rms(distance[d]), rms(angle[a]), int(a.sum())))
    return out


def simulated_size_accuracy(
    true: Rig,
    assumed: Sequence[Rig],
    centre_mm: Float,
    sizes_mm: Sequence[float],
    sigma_px: float,
    rng: np.random.Generator,
    n_angles: int = 200,
    range_mm: float = 50.0,
) -> list[SizeAccuracy]:
    """Return the errors of distances and right angles of given sizes in a simulation.

    Parameters
    ----------
    true
        Rig that takes the images.
    assumed
        Rigs that reconstruct them, one after the other, which includes the uncertainty of the calibration.
    centre_mm
        Centre of the volume, shape (3,), mm.
    sizes_mm
        Lengths of the legs, mm.
    sigma_px
        Noise per image coordinate, px.
    rng
        Source of noise and positions.
    n_angles
        Number of right angles per size, in random orientations.
    range_mm
        Greatest distance of a vertex from the centre along each axis, mm.

    Returns
    -------
    list of SizeAccuracy
        One per size, of the angles in view of both cameras.
    """
    out = []
    for size in sizes_mm:
        a, b = _random_frames(rng, n_angles)
        vertex = centre_mm + rng.uniform(-range_mm, range_mm, (n_angles, 3))
        points = np.stack([vertex, vertex + size * a, vertex + size * b], axis=1)
        measured = np.empty_like(points)
        left, right = (
            camera.project(points) + sigma_px * rng.standard_normal((n_angles, 3, 2))
            for camera in (true.left, true.right)
        )
        for k, rig in enumerate(assumed):
            own = np.arange(n_angles) % len(assumed) == k
            flat = reconstruct(rig, left[own].reshape(-1, 2), right[own].reshape(-1, 2))
            measured[own] = flat.reshape(-1, 3, 3)
        in_view = np.isfinite(measured).all(axis=(1, 2))
        distance = np.linalg.norm(measured[in_view, 1] - measured[in_view, 0], axis=1) - size
        in_both = measured[in_view]
        angle = _angles_deg(in_both[:, 1] - in_both[:, 0], in_both[:, 2] - in_both[:, 0]) - 90
        out.append(SizeAccuracy(float(size), rms(distance), rms(angle), int(in_view.sum())))
    return out


def _angles_deg(a: Float, b: Float) -> Float:
    """Return the angles (n,) between vectors (n, 3) and (n, 3), degrees."""
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    return np.asarray(np.degrees(angle))


def _random_frames(rng: np.random.Generator, n: int) -> tuple[Float, Float]:
    """Return pairs of orthogonal unit vectors (n, 3) in random directions."""
    a = rng.standard_normal((n, 3))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(a, rng.standard_normal((n, 3)))
    return a, b / np.linalg.norm(b, axis=1, keepdims=True)
