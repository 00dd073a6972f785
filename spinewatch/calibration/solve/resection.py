"""Space resection with self-calibration: one camera from one or several shots of a control field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError, PoorFitError, UndeterminedError
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.calibration.solve.blunders import Blunder, BlunderParameters, adjust_without_blunders
from spinewatch.calibration.solve.bundle import Block, BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR, NAMES, camera_from_vector, camera_vector
from spinewatch.calibration.solve.initial_values import (
    exterior,
    start_cameras,
    to_camera_space,
    with_exterior,
)
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

THIRTEEN = NAMES[:13]
"""All parameters of a camera whose aspect is known."""

_BASE = (*EXTERIOR, "f", "x0", "y0", "K1")
_EXTENSIONS: tuple[tuple[str, ...], ...] = ((), ("K2",), ("P1", "P2"), ("K2", "P1", "P2"))
_REDUCTIONS: tuple[tuple[str, ...], ...] = (("K1",), ("x0", "y0"), ("x0", "y0", "K1"))
_EXACT_PX = 1e-6
_GOOD_PX = 0.5
_ROBUST_PX = 0.5
_START_TOLERANCE = 1e-8
_GOOD_FOCAL = 0.005


@dataclass(frozen=True)
class SolveParameters:
    """How cameras are solved.

    ``free`` parameters, or None to choose them by determinability; ``fixed`` values of parameters that are
    known; ``estimate_aspect`` adjusts py/px too. ``max_rms_of_width`` is the image RMS, as a fraction of the
    image's width, above which a fit is refused. ``check_orientation`` refuses boards upside down and
    exchanged sides.
    """

    free: tuple[str, ...] | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    estimate_aspect: bool = False
    max_rms_of_width: float = 0.003
    check_orientation: bool = True
    blunders: BlunderParameters = field(default_factory=BlunderParameters)


@dataclass(frozen=True, eq=False)
class Resection:
    """One camera from its own images; ``adjustment`` is a block of this camera alone."""

    camera: Camera
    placements: tuple[RigidTransform, ...]
    free: tuple[str, ...]
    adjustment: BundleAdjustment
    blunders: tuple[Blunder, ...]


def resect(
    images: Sequence[ImagePoints | None],
    sensor: Sensor,
    parameters: SolveParameters,
    where: str = "the camera",
) -> Resection:
    """Return one camera from its images, one per shot, None where it does not see enough of the board.

    The first shot defines object space. Starts are adjusted until one leaves no doubt, or else all, and the best
    is kept; blunders are removed and named; parameters that the points do not determine stay at zero, those that
    they do not need are left out (corrected Akaike criterion).

    Raises ``TooFewPointsError``, ``PlanarFieldError``, ``MirroredFieldError``, ``UndeterminedError``,
    ``PoorFitError``, ``ConvergenceError``.
    """
    best = _best_start(images, sensor, parameters, where)
    limit = parameters.max_rms_of_width * sensor.image_size_px[0]
    try:
        clean, _ = adjust_without_blunders(best.block, parameters.blunders)
        chosen = _choose_free(clean, parameters, sensor, where)
        full = replace(chosen.block, images=best.block.images)
        final, blunders = adjust_without_blunders(full, parameters.blunders)
    except (PoorFitError, ConvergenceError) as error:
        raise type(error)(f"{where}: {error}") from error
    if not final.rms_px < limit:
        raise PoorFitError(
            f"{where}: the best camera misses the control points by {final.rms_px:.1f} px RMS; check that the"
            " control field is the one in the picture and that points are named right"
        )
    return Resection(final.block.cameras[0], final.block.placements, final.block.free[0], final, blunders)


def _best_start(
    images: Sequence[ImagePoints | None], sensor: Sensor, parameters: SolveParameters, where: str
) -> BundleAdjustment:
    free = _first_free(parameters)
    best: BundleAdjustment | None = None
    for start in start_cameras(images, sensor, where, parameters.fixed.get("f")):
        try:
            block = _oriented(_with_fixed(start, parameters), images, free)
            tried = adjust(block, tolerance=_START_TOLERANCE)
            if _well_determined(tried):
                return tried
            tried = adjust(tried.block, robust_px=_ROBUST_PX, tolerance=_START_TOLERANCE)
        except ConvergenceError:  # a start from which points are out of sight
            continue
        if best is None or _robust_cost(tried) < _robust_cost(best):
            best = tried
    if best is None:
        raise ConvergenceError(
            f"{where}: no start leads to a camera that sees the points; check their coordinates"
        )
    return best


def _well_determined(adjustment: BundleAdjustment) -> bool:
    """Return whether the focal length is known well enough for the minimum to be the only one near."""
    sd = adjustment.sd.get("0:f", np.inf)
    return adjustment.rms_px < _GOOD_PX and sd < _GOOD_FOCAL * adjustment.block.cameras[0].focal_length_mm


def _robust_cost(adjustment: BundleAdjustment) -> float:
    """Return the Cauchy loss of the residuals, which a blunder does not spoil."""
    return float(sum(np.log1p((r / _ROBUST_PX) ** 2).sum() for r in adjustment.residuals_px.values()))


def _first_free(parameters: SolveParameters) -> tuple[str, ...]:
    return tuple(n for n in NAMES if n in (parameters.free or _BASE) and n not in parameters.fixed)


def _with_fixed(camera: Camera, parameters: SolveParameters) -> Camera:
    vector = camera_vector(camera)
    for name, value in parameters.fixed.items():
        vector[NAMES.index(name)] = value
    return camera_from_vector(vector, camera)


def _oriented(camera: Camera, images: Sequence[ImagePoints | None], free: tuple[str, ...]) -> Block:
    """Return the block in which every shot lies where this camera sees it."""
    motions = [None if image is None else exterior(image, camera) for image in images]
    first = next(m for m in motions if m is not None)
    oriented = with_exterior(camera, first)
    back = to_camera_space(oriented).inverse()
    placements = tuple(RigidTransform.identity() if m is None else back @ m for m in motions)
    placements = (RigidTransform.identity(), *placements[1:])
    seen = {(0, s): image for s, image in enumerate(images) if image is not None}
    return Block((oriented,), placements, seen, (free,))


def _choose_free(
    start: BundleAdjustment, parameters: SolveParameters, sensor: Sensor, where: str
) -> BundleAdjustment:
    aspect = ("aspect",) if parameters.estimate_aspect else ()
    if parameters.free is not None:
        wanted = tuple(n for n in NAMES if n in (*parameters.free, *aspect) and n not in parameters.fixed)
        tried = adjust(replace(start.block, free=(wanted,)))
        if not np.all(np.isfinite(tried.cofactor)):
            _refuse_undetermined(tried, sensor, where)
        return tried
    candidates = [(*_BASE, *more, *aspect) for more in _EXTENSIONS]
    best = _best_determined(start, candidates, parameters, sensor)
    if best is None:
        fewer = [(*(n for n in _BASE if n not in without), *aspect) for without in _REDUCTIONS]
        best = _best_determined(start, fewer, parameters, sensor)
    if best is None:
        minimal = tuple(n for n in (*EXTERIOR, "f") if n not in parameters.fixed)
        best = adjust(replace(start.block, free=(minimal,)))
        _refuse_undetermined(best, sensor, where)
    return best


def _best_determined(
    start: BundleAdjustment,
    candidates: Sequence[tuple[str, ...]],
    parameters: SolveParameters,
    sensor: Sensor,
) -> BundleAdjustment | None:
    best, least = None, np.inf
    for names in candidates:
        free = tuple(n for n in NAMES if n in names and n not in parameters.fixed)
        block = replace(
            start.block, free=(free,), cameras=(_without(start.block.cameras[0], free, parameters),)
        )
        if block.redundancy < 0 or (best is not None and block.redundancy < 2):
            continue
        try:
            tried = adjust(block)
        except ConvergenceError:
            continue
        if undetermined(tried, sensor):
            continue
        score = _akaike(tried)
        if best is None or score < least:
            best, least = tried, score
    return best


def _without(camera: Camera, free: tuple[str, ...], parameters: SolveParameters) -> Camera:
    """Return the camera with lens parameters that are neither free nor fixed at zero."""
    vector = camera_vector(camera)
    for name in ("x0", "y0", "K1", "K2", "P1", "P2"):
        if name not in free and name not in parameters.fixed:
            vector[NAMES.index(name)] = 0.0
    return camera_from_vector(vector, camera)


def _akaike(adjustment: BundleAdjustment) -> float:
    n, k = adjustment.block.observations, adjustment.block.unknowns + 1
    weighted = [r / adjustment.block.images[v].sd_px[:, None] for v, r in adjustment.residuals_px.items()]
    square = float(sum((w * w).sum() for w in weighted)) / n + _EXACT_PX**2
    small_sample = 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else np.inf
    return n * float(np.log(square)) + 2 * k + small_sample


def plausible_range(sensor: Sensor) -> dict[str, float]:
    """Return the uncertainty of each interior parameter beyond which nothing is known of it.

    A quarter of the focal length is judged apart. Principal point: half the plate. Lens: a fifth of the radius
    at the corner of the plate.
    """
    half = sensor.plate_mm / 2
    corner = float(np.hypot(*half))
    return {
        "x0": float(half[0]),
        "y0": float(half[1]),
        "K1": 0.2 / corner**2,
        "K2": 0.2 / corner**4,
        "P1": 0.2 / corner,
        "P2": 0.2 / corner,
        "aspect": 0.05,
    }


def undetermined(adjustment: BundleAdjustment, sensor: Sensor) -> tuple[str, ...]:
    """Return the names of interior parameters that the points of a one-camera block leave open."""
    free = adjustment.block.free[0]
    if not np.all(np.isfinite(adjustment.cofactor)):
        return free
    ranges = {**plausible_range(sensor), "f": adjustment.block.cameras[0].focal_length_mm / 4}
    if adjustment.block.redundancy <= 0:
        return ()
    sd = _interior_sd(adjustment)
    return tuple(n for n in free if n in ranges and not sd[n] < ranges[n])


def _interior_sd(adjustment: BundleAdjustment) -> dict[str, float]:
    variance: Float = np.diag(adjustment.cofactor) * adjustment.sigma0**2
    return {n: float(np.sqrt(v)) for n, v in zip(adjustment.block.free[0], variance, strict=False)}


def _refuse_undetermined(adjustment: BundleAdjustment, sensor: Sensor, where: str) -> None:
    if names := undetermined(adjustment, sensor):
        raise UndeterminedError(
            f"{where}: the points leave {', '.join(names)} open; show more points, over the whole image and at"
            " different heights, or fix these parameters",
            names,
        )
