"""Refinement of candidate sets by the structural similarity of the features' surroundings (section 5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import Features
from spinewatch.matching.epipolar import CandidatePairs

_BALL_MM = 8.0
_SMALL_VERGENCE_DEG = 28.0
_FLAT = 1e-2  # a window of no structure but rounding, gray levels


@dataclass(frozen=True)
class RefinementParameters:
    """How candidates are compared.

    ``window_balls`` is the window's side in ball diameters (75 px for a ball of 10 px), compared on a grid of
    ``grid`` x ``grid`` samples. A candidate stays when its correlation exceeds ``threshold`` times the best of
    the set; None takes 0.8 below a vergence of 28 degrees, between the thesis's two configurations, and 0.5
    above. Off by default: of 151 true pairs in rendered scenes it loses 9% (17% judged from the left image alone)
    and with them only a fifth of the false ones, which the triads' geometry removes anyway.
    """

    enabled: bool = False
    window_balls: float = 7.5
    grid: int = 25
    threshold: float | None = None


def refine_candidates(
    pairs: CandidatePairs,
    left: Features,
    right: Features,
    images: tuple[NDArray[np.generic], NDArray[np.generic]],
    rig: Rig,
    parameters: RefinementParameters,
) -> CandidatePairs:
    """Return the pairs that survive eq. 5.11 from the left feature's or from the right feature's side.

    Departures: windows are sampled on a coarser grid and scale with the balls; a candidate must fail in both
    directions to be dropped; a set whose best correlation is not positive says nothing and is kept whole.
    """
    windows = (
        feature_windows(image, features, camera, _mean_range(rig), parameters)
        for image, features, camera in zip(images, (left, right), (rig.left, rig.right), strict=True)
    )
    rho = np.einsum("pk,pk->p", *(w[i] for w, i in zip(windows, (pairs.left, pairs.right), strict=True)))
    threshold = parameters.threshold
    if threshold is None:
        threshold = 0.8 if rig.vergence_deg < _SMALL_VERGENCE_DEG else 0.5
    kept = _near_best(rho, pairs.left, len(left), threshold) | _near_best(
        rho, pairs.right, len(right), threshold
    )
    return CandidatePairs(pairs.left[kept], pairs.right[kept])


def feature_windows(
    image: NDArray[np.generic],
    features: Features,
    camera: Camera,
    range_mm: float,
    parameters: RefinementParameters,
) -> Float:
    """Return windows (n, grid^2) around features of zero mean and unit length (0 if flat): a dot product is rho.

    Windows that reach past the border see the border's pixels repeated.
    """
    ball = np.array(camera.ball_diameter_px(_BALL_MM, range_mm))
    step = parameters.window_balls * ball / parameters.grid
    size = np.maximum(np.round(np.array(camera.image_size_px) / step), 1).astype(int)
    coarse = cv2.resize(
        np.asarray(image, dtype=np.float32), (int(size[0]), int(size[1])), interpolation=cv2.INTER_AREA
    )
    scale = size / camera.image_size_px
    centre = np.round((features.xy_px + 0.5) * scale - 0.5).astype(int)
    offset = np.arange(parameters.grid) - parameters.grid // 2
    u = np.clip(centre[:, 0, None] + offset, 0, size[0] - 1)
    v = np.clip(centre[:, 1, None] + offset, 0, size[1] - 1)
    windows = coarse[v[:, :, None], u[:, None, :]].reshape(len(features), -1).astype(np.float64)
    windows -= windows.mean(axis=1, keepdims=True)
    length = np.linalg.norm(windows, axis=1, keepdims=True)
    return np.where(length > _FLAT, windows / np.maximum(length, _FLAT), 0.0)


def _near_best(rho: Float, owner: NDArray[np.intp], owners: int, threshold: float) -> NDArray[np.bool_]:
    best = np.full(owners, -1.0)
    np.maximum.at(best, owner, rho)
    return rho > np.where(best > 0, threshold * best, -2.0)[owner]


def _mean_range(rig: Rig) -> float:
    half = np.radians(max(rig.vergence_deg, 1e-3) / 2)
    return float(rig.baseline_mm / 2 / np.tan(half))
