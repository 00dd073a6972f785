"""Both cameras of a rig from coordinates: resection of each, then one bundle adjustment of all shots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import BoardOrientationError, SidesSwappedError, TooFewPointsError
from spinewatch.calibration.points import ImagePoints, Sensor, Shot, refuse_contradictions
from spinewatch.calibration.solve.blunders import adjust_without_blunders
from spinewatch.calibration.solve.bundle import Block, BundleAdjustment, ImageIndex
from spinewatch.calibration.solve.collinearity import COUNT, NAMES, camera_from_vector, camera_vector
from spinewatch.calibration.solve.resection import Resection, SolveParameters, resect
from spinewatch.camera import Camera, Rig
from spinewatch.errors import SameImageError
from spinewatch.flags import Flag
from spinewatch.geometry.transforms import RigidTransform

SIDES = ("left", "right")
FOR_EXTERIOR = 4
"""Points that one image must show of a shot to take part in it."""

_CORRELATED = 0.95


@dataclass(frozen=True)
class RemovedPoint:
    """A point that contradicts the others: ``side``, ``shot``, ``id``, and how far its image lies off, px."""

    side: str
    shot: str
    id: str
    miss_px: float


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated rig and how well it is known.

    ``free`` names the adjusted parameters by side; ``sd`` their standard deviations (NaN without redundancy);
    ``correlation`` (u, u) in the order of ``adjustment.names``; ``placements`` of the board per shot, the first
    being object space; ``removed`` the blunders.
    """

    rig: Rig
    shots: tuple[Shot, ...]
    placements: tuple[RigidTransform, ...]
    free: Mapping[str, tuple[str, ...]]
    sd: Mapping[str, Mapping[str, float]]
    adjustment: BundleAdjustment
    removed: tuple[RemovedPoint, ...]
    flags: tuple[Flag, ...]

    @property
    def correlation(self) -> Float:
        """Correlation (u, u) of all unknowns."""
        s = np.sqrt(np.diag(self.adjustment.cofactor))
        return np.asarray(self.adjustment.cofactor / np.outer(s, s))

    @property
    def rms_px(self) -> Mapping[str, float]:
        """Image RMS per coordinate of each side, px."""
        return {side: self.adjustment.camera_rms_px(c) for c, side in enumerate(SIDES)}

    def without_removed(self) -> tuple[Shot, ...]:
        """Return the shots without the removed points."""
        gone = {(r.side, r.shot, r.id) for r in self.removed}

        def cleaned(shot: Shot, side: str) -> ImagePoints:
            image: ImagePoints = getattr(shot, side)
            return image.keep(np.array([(side, shot.name, i) not in gone for i in image.ids], dtype=bool))

        return tuple(Shot(s.name, cleaned(s, "left"), cleaned(s, "right")) for s in self.shots)


def calibrate(
    shots: Sequence[Shot],
    sensors: tuple[Sensor, Sensor],
    parameters: SolveParameters | None = None,
    name: str = "rig",
) -> Calibration:
    """Return the rig that took these shots of one control field; the first shot defines object space.

    Raises ``TooFewPointsError``, ``PlanarFieldError``, ``MirroredFieldError``, ``UndeterminedError``,
    ``PoorFitError``, ``ConvergenceError``, ``BoardOrientationError``, ``SidesSwappedError`` and ``SameImageError``.
    """
    parameters = parameters or SolveParameters()
    _refuse_empty(shots)
    _refuse_same(shots)
    refuse_contradictions(
        (f"the {side} image of shot {shot.name}", getattr(shot, side)) for shot in shots for side in SIDES
    )
    resections = [
        resect(_images(shots, side), sensor, parameters, f"the {side} camera")
        for side, sensor in zip(SIDES, sensors, strict=True)
    ]
    cameras = tuple(r.camera for r in resections)
    if parameters.check_orientation:
        _refuse_orientation(cameras[0], cameras[1], shots[0])
    return _conclude(_joint(shots, resections), shots, parameters, name)


def readjust(
    calibration: Calibration, shots: Sequence[Shot], parameters: SolveParameters | None = None
) -> Calibration:
    """Return the calibration adjusted anew to shots whose points have been improved, from where it stands."""
    block = calibration.adjustment.block
    full = Block(block.cameras, calibration.placements, _views(shots), block.free)
    return _conclude(full, shots, parameters or SolveParameters(), calibration.rig.name)


def _conclude(block: Block, shots: Sequence[Shot], parameters: SolveParameters, name: str) -> Calibration:
    adjustment, blunders = adjust_without_blunders(block, parameters.blunders)
    left, right = adjustment.block.cameras
    removed = tuple(RemovedPoint(SIDES[b.camera], shots[b.placement].name, b.id, b.miss_px) for b in blunders)
    sd = {side: _sd(adjustment, c) for c, side in enumerate(SIDES)}
    free = {side: adjustment.block.free[c] for c, side in enumerate(SIDES)}
    flags = calibration_flags(adjustment, free, removed)
    placements = adjustment.block.placements
    return Calibration(Rig(name, left, right), tuple(shots), placements, free, sd, adjustment, removed, flags)


def _refuse_empty(shots: Sequence[Shot]) -> None:
    if not shots:
        raise TooFewPointsError("no shot of a control field was given; give at least one stereo pair")
    for side in SIDES:
        count = len(getattr(shots[0], side))
        if count < FOR_EXTERIOR:
            raise TooFewPointsError(
                f"the {side} image of the first shot, {shots[0].name}, has {count} control points; the first shot"
                " defines object space and needs at least 6 in both images"
            )


def _refuse_same(shots: Sequence[Shot]) -> None:
    for shot in shots:
        if np.array_equal(shot.left.pixels, shot.right.pixels):
            raise SameImageError(
                f"shot {shot.name}: left and right show the same image points; give those of two cameras"
            )


def _images(shots: Sequence[Shot], side: str) -> list[ImagePoints | None]:
    images: list[ImagePoints] = [getattr(shot, side) for shot in shots]
    return [image if len(image) >= FOR_EXTERIOR else None for image in images]


def _views(shots: Sequence[Shot]) -> dict[ImageIndex, ImagePoints]:
    return {
        (c, s): image
        for c, side in enumerate(SIDES)
        for s, image in enumerate(_images(shots, side))
        if image is not None
    }


def _joint(shots: Sequence[Shot], resections: Sequence[Resection]) -> Block:
    left, right = resections
    views = _views(shots)
    placements = tuple(
        left.placements[s] if (0, s) in views else right.placements[s] for s in range(len(shots))
    )
    return Block((left.camera, right.camera), placements, views, (left.free, right.free))


def _refuse_orientation(left: Camera, right: Camera, first: Shot) -> None:
    for side, camera, image in (("left", left, first.left), ("right", right, first.right)):
        centroid = image.control_mm.mean(axis=0)
        if camera.centre[2] < centroid[2]:
            raise BoardOrientationError(
                f"the {side} camera would lie below the board: Z of the control field must point up to the"
                " cameras; check the signs of its coordinates"
            )
        if camera.M[0, 0] <= 0:
            turned = abs(float(np.degrees(np.arctan2(camera.M[1, 0], camera.M[0, 0]))))
            raise BoardOrientationError(
                f"the board is turned by {turned:.0f} degrees in the {side} image: lay it so that its X runs to the"
                " right in both images, or mount the cameras upright"
            )
    if left.M[0] @ (right.centre - left.centre) < 0:
        raise SidesSwappedError("the left picture was taken by the right camera; exchange left and right")


def _sd(adjustment: BundleAdjustment, camera: int) -> Mapping[str, float]:
    prefix = f"{camera}:"
    return {n.removeprefix(prefix): v for n, v in adjustment.sd.items() if n.startswith(prefix)}


def calibration_flags(
    adjustment: BundleAdjustment, free: Mapping[str, tuple[str, ...]], removed: Sequence[RemovedPoint]
) -> tuple[Flag, ...]:
    """Return what to know of an adjustment whose cameras have these free parameters, by name."""
    return (*_blunder_flags(removed), *_determinability_flags(adjustment, free))


def _blunder_flags(removed: Sequence[RemovedPoint]) -> tuple[Flag, ...]:
    return tuple(
        Flag(
            "control-point-removed",
            f"{r.side}, shot {r.shot}: point {r.id} lies {r.miss_px:.2f} px off and was left out",
        )
        for r in removed
    )


def _determinability_flags(
    adjustment: BundleAdjustment, free: Mapping[str, tuple[str, ...]]
) -> tuple[Flag, ...]:
    flags = []
    if not adjustment.converged:
        flags.append(
            Flag(
                "adjustment-unfinished",
                "the adjustment was stopped before its residuals ceased to fall; give more points, or free fewer"
                " parameters",
            )
        )
    if adjustment.block.redundancy <= 0:
        flags.append(
            Flag(
                "no-redundancy", "the points just suffice: nothing is known of the accuracy; show more points"
            )
        )
    for side, names in free.items():
        kept = [n for n in ("f", "x0", "y0", "K1") if n not in names]
        if kept:
            flags.append(
                Flag(
                    "parameters-held",
                    f"{side}: {', '.join(kept)} held: not determined by the points, or not to be adjusted",
                )
            )
    return tuple(flags)


def sampled_rigs(calibration: Calibration, count: int, rng: np.random.Generator) -> list[Rig]:
    """Return rigs drawn from the calibration's covariance: what else the cameras might be."""
    cameras = (calibration.rig.left, calibration.rig.right)
    adjustment = calibration.adjustment
    columns = [(c, NAMES.index(n)) for c, free in enumerate(adjustment.block.free) for n in free]
    k = len(columns)
    S = adjustment.covariance[:k, :k]
    scale = np.sqrt(np.diag(S))
    w, V = np.linalg.eigh(S / np.outer(scale, scale))
    draws = rng.standard_normal((count, k)) * np.sqrt(np.maximum(w, 0)) @ V.T * scale
    rigs = []
    for draw in draws:
        change = np.zeros((2, COUNT))
        for (c, i), d in zip(columns, draw, strict=True):
            change[c, i] = d
        left, right = (
            camera_from_vector(camera_vector(cam) + change[c], cam) for c, cam in enumerate(cameras)
        )
        rigs.append(Rig(calibration.rig.name, left, right))
    return rigs
