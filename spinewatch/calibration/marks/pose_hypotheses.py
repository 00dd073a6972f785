"""Hypotheses of the pose of a control field: three neighbouring targets as any three similar control points (P3P)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.calibration.marks.assignment import IdentificationTask, MarkIdentificationParameters
from spinewatch.calibration.solve.orientation import from_opencv_pose, opencv_directions, with_orientation
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import rotation_from_vector

_POSES_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class PoseHypothesis:
    """An approximate camera and how many targets it explains.

    Attributes
    ----------
    camera
        The camera.
    score
        Sum over the targets of 1 - (d / tolerance)^2 for the distance d of the nearest control point, at least 0.
    """

    camera: Camera
    score: float


def seed_triples(pixels: Float, parameters: MarkIdentificationParameters | None = None) -> Iterator[Int]:
    """Yield triples of neighbouring targets, the most central first.

    Parameters
    ----------
    pixels
        Targets, shape (n, 2), px.
    parameters
        What a seed is.

    Yields
    ------
    Int
        Indices of three targets that are not nearly collinear, shape (3,).

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.array([[x, y] for y in (0.0, 10.0, 21.0) for x in (0.0, 10.0, 21.0)])
    >>> next(seed_triples(grid)).tolist()
    [4, 1, 3]
    """
    parameters = parameters or MarkIdentificationParameters()
    centre = np.median(pixels, axis=0)
    for first in np.argsort(np.linalg.norm(pixels - centre, axis=1)):
        offset = pixels - pixels[first]
        near = np.argsort(np.linalg.norm(offset, axis=1))[1 : 1 + parameters.seed_neighbours]
        for second, third in ((near[0], k) for k in near[1:]):
            a, b = offset[second], offset[third]
            sine = (a[0] * b[1] - a[1] * b[0]) / (np.linalg.norm(a) * np.linalg.norm(b))
            if abs(sine) > parameters.min_seed_sine:
                yield np.array([first, second, third])
                break


def pose_hypotheses(task: IdentificationTask, seed: Int, camera: Camera) -> list[PoseHypothesis]:
    """Return the poses that explain most targets when the seed is three neighbouring control points.

    Parameters
    ----------
    task
        Targets and control field.
    seed
        Indices of three targets, shape (3,).
    camera
        Camera with the interior orientation.

    Returns
    -------
    list of PoseHypothesis
        In decreasing order of score, at most ``max_hypotheses``.

    References
    ----------
    T. Ke, S. Roumeliotis, "An efficient algebraic solution to the perspective-three-point problem", CVPR 2017.
    M. Fischler, R. Bolles, "Random sample consensus", Comm. ACM 24 (1981) 381-395.
    """
    X, pixels = task.field.points_mm, task.pixels
    directions = opencv_directions(camera, pixels[seed])
    vectors: list[Float] = []
    translations: list[Float] = []
    for triple in _similar_triples(pixels[seed], X, camera, task.parameters):
        _, r, t = cv2.solveP3P(X[triple], directions, np.eye(3), None, flags=cv2.SOLVEPNP_AP3P)
        vectors += (np.asarray(v, dtype=np.float64) for v in r)
        translations += (np.asarray(v, dtype=np.float64) for v in t)
    if not vectors:
        return []
    R, T = rotation_from_vector(np.array(vectors).reshape(-1, 3)), np.array(translations).reshape(-1, 3)
    facing = R[:, 2, 2] < 0  # the board's Z points to the camera, OpenCV's away from it
    R, T = R[facing], T[facing]
    score = np.empty(len(R))
    for first in range(0, len(R), _POSES_AT_ONCE):
        part = slice(first, first + _POSES_AT_ONCE)
        score[part] = _scores(R[part], T[part], X, camera, pixels, task.coarse_px)
    best = np.argsort(-score, kind="stable")[: task.parameters.max_hypotheses]
    return [
        PoseHypothesis(with_orientation(camera, from_opencv_pose(R[k], T[k])), float(score[k])) for k in best
    ]


def _similar_triples(
    seed_px: Float, X: Float, camera: Camera, parameters: MarkIdentificationParameters
) -> Int:
    """Return the triples (m, 3) of neighbouring control points whose triangle resembles the seed's, seen from above."""
    image = camera.plate(seed_px)
    a, b = image[1] - image[0], image[2] - image[0]
    d = np.linalg.norm(X[:, None, :2] - X[None, :, :2], axis=2)
    near = np.argsort(d, axis=1, kind="stable")[:, 1 : parameters.control_neighbours + 1]
    p = np.repeat(np.arange(len(X)), near.shape[1] ** 2)
    q = np.repeat(near, near.shape[1], axis=1).ravel()
    r = np.tile(near, (1, near.shape[1])).ravel()
    A, B = X[q, :2] - X[p, :2], X[r, :2] - X[p, :2]
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (A, B, A - B))
    with np.errstate(divide="ignore", invalid="ignore"):
        scales = np.stack([np.linalg.norm(a) / la, np.linalg.norm(b) / lb, np.linalg.norm(a - b) / lc])
        ratio = scales.max(axis=0) / scales.min(axis=0)
        similar = (q != r) & (ratio < parameters.max_shape_ratio)
    side = np.sign(a[0] * b[1] - a[1] * b[0])
    similar &= side * (A[:, 0] * B[:, 1] - A[:, 1] * B[:, 0]) > 0
    kept = np.flatnonzero(similar)
    kept = kept[np.argsort(ratio[kept], kind="stable")[: parameters.max_triples]]
    return np.asarray(np.stack([p, q, r], axis=1)[kept])


def _scores(R: Float, T: Float, X: Float, camera: Camera, pixels: Float, tolerance_px: float) -> Float:
    """Return the scores (m,) of poses R (m, 3, 3), T (m, 3) in OpenCV's axes; distortion is neglected."""
    Xc = np.einsum("mij,nj->mni", R, X) + T[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ideal = camera.focal_length_mm * Xc[..., :2] / Xc[..., 2:] * (1, -1)
    ideal[Xc[..., 2] <= 0] = np.inf
    predicted = camera.pixels(ideal)
    d2 = ((predicted[:, None] - pixels[None, :, None]) ** 2).sum(axis=3).min(axis=2)
    return np.asarray(np.maximum(1 - d2 / tolerance_px**2, 0).sum(axis=1))
