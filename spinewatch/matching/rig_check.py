"""The rig checks itself: whether balls seen in both views still satisfy the calibration's epipolar geometry.

A camera that was bumped no longer sees the right image of a ball on the epipolar line of the left one. Only
that distance shows it: turns and shifts that move images along the lines pass for other depths and cannot be
seen, least of all a turn about the vertical of the picture or a shift along the base. What is estimated says
so by its deviations, which there stay as large as before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays

_STEP = 1e-4
_TRUST = 20  # residuals that the features' covariances are worth
_LEAST_SHARE = 1e-6  # of the strongest direction's information


@dataclass(frozen=True)
class RigCheckParameters:
    """When a rig is said to have drifted.

    ``tolerance_mrad`` is how far the views' directions may be off anyway, by the calibration and by what a
    detector gets wrong alike in all balls; ``chance`` of flagging such a rig. A bump turns a camera by some
    ``bump_deg`` and shifts it by some ``bump_mm``. ``min_balls`` that say anything. ``refine``: measure
    anew with the relative orientation corrected by the balls when the rig has drifted.
    """

    tolerance_mrad: float = 0.035
    chance: float = 1e-3
    bump_deg: float = 0.1
    bump_mm: float = 0.5
    min_balls: int = 6
    refine: bool = False


@dataclass(frozen=True, eq=False)
class RigCheck:
    """What n balls say about the rig.

    ``rms_px``, epipolar residuals as distances in the right image; ``chi2`` of the part that a moved camera
    would explain, ``freedom`` degrees of it, and ``chance`` of as much without a move. ``turn_deg`` (3,) and
    ``shift_mm`` (3,), in the right camera's axes, is the likeliest move of it relative to the left one, with
    deviations ``turn_sd_deg`` and ``shift_sd_mm``.
    """

    balls: int
    rms_px: float
    chi2: float
    freedom: int
    chance: float
    drifted: bool
    turn_deg: Float
    turn_sd_deg: Float
    shift_mm: Float
    shift_sd_mm: Float

    @property
    def sentence(self) -> str:
        """What there is to say of a drift."""
        turn, shift = (
            ", ".join(f"{value:.{digits}f} ± {sd:.{digits}f}" for value, sd in zip(values, sds, strict=True))
            for values, sds, digits in (
                (self.turn_deg, self.turn_sd_deg, 3),
                (self.shift_mm, self.shift_sd_mm, 2),
            )
        )
        return (
            f"{self.balls} balls miss their epipolar lines by {self.rms_px:.2f} px; a camera was bumped, the right"
            f" one by about ({turn}) degrees and ({shift}) mm if it was that one; calibrate again"
        )


def check_rig(
    rig: Rig, left: Features, right: Features, parameters: RigCheckParameters | None = None
) -> RigCheck | None:
    """Return whether the balls whose images are the i-th left and right features fit the rig; None for too few.

    The balls of several stages may be put together: the longer the list, the smaller the drift that is seen.
    Residuals that no move explains scale all deviations, so that poor features are not taken for a drift.
    """
    p = parameters or RigCheckParameters()
    if len(left) < p.min_balls:
        return None
    rays_left, rays_right = (
        left.rays(rig.left),
        right.rays(rig.right),
    )
    e, sd, px = _residuals(rig.left, rig.right, rays_left, rays_right)
    r, J = e / sd, np.empty((len(e), 6))
    for k, move in enumerate(np.eye(6) * _STEP):
        moved, _, _ = _residuals(rig.left, rig.right.moved(move[:3], move[3:]), rays_left, rays_right)
        J[:, k] = (moved - e) / sd / _STEP
    unit = np.repeat([np.radians(p.bump_deg), p.bump_mm], 3)
    A, b = (J * unit).T @ (J * unit), -(J * unit).T @ r
    explained = b @ np.linalg.pinv(A, hermitian=True, rcond=_LEAST_SHARE) @ b
    noise = float((_TRUST + r @ r - explained) / (_TRUST + len(r) - 5))  # by what no move explains
    A, b = A / noise, b / noise
    q, freedom = _surprise(A, b, (p.tolerance_mrad / 1000 / unit[0]) ** 2)
    S = np.linalg.inv(A + np.eye(6))
    move, deviation = S @ b * unit, np.sqrt(np.diag(S)) * unit
    chance = float(chi2.sf(q, freedom))
    return RigCheck(
        balls=len(left),
        rms_px=float(np.sqrt(np.mean(px**2))),
        chi2=q,
        freedom=freedom,
        chance=chance,
        drifted=chance < p.chance,
        turn_deg=np.degrees(move[:3]),
        turn_sd_deg=np.degrees(deviation[:3]),
        shift_mm=move[3:],
        shift_sd_mm=deviation[3:],
    )


def refined_rig(rig: Rig, check: RigCheck) -> Rig:
    """Return the rig with its right camera moved as a check found likeliest; its name says so.

    The relative orientation alone is refined: object space stays that of the left camera.
    """
    return Rig(
        f"{rig.name} (refined)",
        rig.left,
        rig.right.moved(np.radians(check.turn_deg), check.shift_mm),
    )


def moved_camera(camera: Camera, turn_rad: Float, shift_mm: Float) -> Camera:
    """Return a camera turned by a rotation vector (3,) and shifted (3,), both in its own axes."""
    M = Rotation.from_rotvec(turn_rad).as_matrix() @ camera.M
    centre = camera.centre + camera.M.T @ shift_mm
    angles = np.degrees(
        [np.arctan2(-M[2, 1], M[2, 2]), np.arcsin(np.clip(M[2, 0], -1, 1)), np.arctan2(-M[1, 0], M[0, 0])]
    )
    return replace(
        camera,
        position_mm=(float(centre[0]), float(centre[1]), float(centre[2])),
        rotation_deg=(float(angles[0]), float(angles[1]), float(angles[2])),
    )


def _surprise(A: Float, b: Float, tolerance: float) -> tuple[float, int]:
    """Return the chi-square of b and its degrees of freedom, when moves have the variance ``tolerance``."""
    values, vectors = np.linalg.eigh(A)
    seen = values > _LEAST_SHARE * values[-1]
    along, information = vectors[:, seen].T @ b, values[seen]
    return float((along**2 / (information + tolerance * information**2)).sum()), int(seen.sum())


def _residuals(left: Camera, right: Camera, rays_left: Rays, rays_right: Rays) -> tuple[Float, Float, Float]:
    """Return coplanarity errors (n,), their standard deviations, and the same errors as pixels in the right image."""
    base = right.centre - left.centre
    vectors = np.column_stack([rays_right.ideal_mm, np.full(len(rays_right), -right.focal_length_mm)])
    vectors = vectors @ right.M
    normal = np.cross(base, rays_left.vectors)
    e = (normal * vectors).sum(axis=1)
    in_right = normal @ right.M[:2].T
    in_left = np.cross(vectors, base) @ left.M[:2].T
    variance = np.einsum("ni,nij,nj->n", in_right, rays_right.covariance_mm2, in_right)
    variance += np.einsum("ni,nij,nj->n", in_left, rays_left.covariance_mm2, in_left)
    px = e / np.linalg.norm(in_right, axis=1) / right.pixel_size_mm[1]
    return e, np.sqrt(variance), px
