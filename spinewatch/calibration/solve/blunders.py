"""Blunders (gross errors): points that contradict the others, detected by robust adjustment and F-tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Bool
from spinewatch.calibration.errors import PoorFitError
from spinewatch.calibration.solve.block import Block, ImageIndex
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, project_with_derivatives
from spinewatch.robust import MAD_TO_SD

_MIN_DOF = 2
_MIN_TEST_DOF = 4
_UNTESTABLE = 1e-6

Masks = Mapping[ImageIndex, Bool]
"""Which points of each image are kept, shape (n,)."""


@dataclass(frozen=True)
class BlunderParameters:
    """When a point counts as a blunder.

    Attributes
    ----------
    significance
        Probability that a calibration without blunders loses a point; shared among all points (Bonferroni). In
        simulation 1% leaves fewer blunders and better cameras than 0.1%, and 5% removes good points
        (docs/calibration.md).
    readmission
        p-value above which a suspect is taken back.
    floor_px
        Residual below which no point is suspicious, px.
    max_fraction
        Greatest fraction of the points of an image that may be removed.
    min_kept
        Fewest points of an image that must remain.
    contamination_sigmas
        Residual, in robust standard deviations, from which a robust adjustment is made.
    suspect_sigmas
        Residual of the robust adjustment from which a point is a suspect, in robust standard deviations.
    robust_sigmas
        Scale of Cauchy's loss, in robust standard deviations.
    max_exact_points
        Points of all images up to which the block is adjusted again after every test; with more, several points are
        tested by the linearized adjustment first.
    enabled
        Whether points are tested at all.
    """

    significance: float = 0.01
    readmission: float = 0.01
    floor_px: float = 0.05
    max_fraction: float = 0.25
    min_kept: int = 6
    contamination_sigmas: float = 4.0
    suspect_sigmas: float = 5.0
    robust_sigmas: float = 2.0
    max_exact_points: int = 400
    enabled: bool = True


@dataclass(frozen=True)
class Blunder:
    """A point that was removed because it contradicts the others.

    Attributes
    ----------
    camera
        Index of the camera.
    shot
        Index of the shot (of the placement).
    id
        Name of the control point.
    residual_px
        Distance of its image from the one computed without it, px.
    """

    camera: int
    shot: int
    id: str
    residual_px: float


def adjust_without_blunders(
    block: Block, parameters: BlunderParameters
) -> tuple[BundleAdjustment, tuple[Blunder, ...]]:
    """Return the adjustment of the points that agree with each other, and those that were removed.

    A robust adjustment finds suspects, so that several blunders cannot mask each other. A suspect is taken back unless
    an F-test of its prediction rejects it. Then the remaining points are tested one at a time by their studentized
    residuals, the largest first.

    Parameters
    ----------
    block
        Initial values and observations.
    parameters
        Levels of the tests.

    Returns
    -------
    adjustment : BundleAdjustment
        The adjustment of the remaining points.
    blunders : tuple of Blunder
        The removed points.

    Raises
    ------
    PoorFitError
        If more than the permitted fraction of an image's points would have to be removed.
    ConvergenceError
        If a camera does not have its points in view.

    References
    ----------
    W. Baarda, "A testing procedure for use in geodetic networks" (1968). R. D. Cook, S. Weisberg, Residuals and
    Influence in Regression (1982), section 2.2: externally studentized residuals.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.geometry.transforms import RigidTransform
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> pixels = camera.project(field.points_mm)
    >>> pixels[4] += 5.0
    >>> image = ImagePoints.build(field.ids, field.points_mm, pixels)
    >>> block = Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (("X0", "Y0", "Z0"),))
    >>> [blunder.id for blunder in adjust_without_blunders(block, BlunderParameters())[1]]
    ['5']
    """
    first = adjust(block)
    if not parameters.enabled or first.block.dof <= _MIN_DOF:
        return first, ()
    kept: Masks = {view: np.ones(len(image), dtype=bool) for view, image in block.images.items()}
    current = first
    if _is_contaminated(first, parameters):
        robust = first
        for _ in range(2):
            scale = parameters.robust_sigmas * _robust_sigma(robust, parameters)
            robust = adjust(robust.block, robust_scale=scale)
        kept = _unsuspected(robust, parameters)
        current = adjust(_reduced(robust.block, block, kept))
        current, kept = _readmit(block, current, kept, parameters)
    current, kept = _remove_worst(block, current, kept, parameters)
    return current, _removed(block, current, kept)


def _is_contaminated(adjustment: BundleAdjustment, parameters: BlunderParameters) -> bool:
    largest = max(float(np.abs(w).max()) for w in adjustment.weighted_residuals.values() if len(w))
    return largest > parameters.contamination_sigmas * _robust_sigma(adjustment, parameters)


def _floor(block: Block, parameters: BlunderParameters) -> float:
    """Return the least weighted residual that is suspicious."""
    sd = np.concatenate([image.sd_px for image in block.images.values()])
    return parameters.floor_px / float(np.median(sd))


def _robust_sigma(adjustment: BundleAdjustment, parameters: BlunderParameters) -> float:
    """Return the standard deviation of unit weight from the median of the residuals, at least the floor."""
    weighted = np.concatenate([w.ravel() for w in adjustment.weighted_residuals.values()])
    inflation = np.sqrt(len(weighted) / max(adjustment.block.dof, 1))
    sigma = float(MAD_TO_SD * np.median(np.abs(weighted)) * inflation)
    return max(sigma, _floor(adjustment.block, parameters))


def _unsuspected(adjustment: BundleAdjustment, parameters: BlunderParameters) -> Masks:
    limit = parameters.suspect_sigmas * _robust_sigma(adjustment, parameters)
    return {view: np.abs(w).max(axis=1) < limit for view, w in adjustment.weighted_residuals.items()}


def _reduced(at: Block, full: Block, kept: Masks) -> Block:
    """Return the block with the points kept of the full block, and initial values ``at``."""
    return replace(at, images={view: image.keep(kept[view]) for view, image in full.images.items()})


def _with(kept: Masks, view: ImageIndex, i: int, value: bool) -> Masks:
    """Return the masks with one point kept or removed."""
    mask = kept[view].copy()
    mask[i] = value
    return {**kept, view: mask}


def _readmit(
    block: Block, current: BundleAdjustment, kept: Masks, parameters: BlunderParameters
) -> tuple[BundleAdjustment, Masks]:
    """Return the adjustment and the points kept after suspects were taken back, the most probable first."""
    while True:
        suspects = [(view, int(i)) for view, mask in kept.items() for i in np.nonzero(~mask)[0]]
        p_values = [_prediction_p_value(block, current, view, i, parameters) for view, i in suspects]
        if not suspects or max(p_values) <= parameters.readmission:
            _check_removed(kept, parameters)
            return current, kept
        n_points = sum(map(len, block.images.values()))
        n_back = 1 if n_points <= parameters.max_exact_points else max(1, len(suspects) // 4)
        for k in np.argsort(p_values, kind="stable")[::-1][:n_back]:
            if p_values[k] > parameters.readmission:
                view, i = suspects[k]
                kept = _with(kept, view, i, value=True)
        current = adjust(_reduced(current.block, block, kept))


def _prediction_p_value(
    block: Block, current: BundleAdjustment, view: ImageIndex, i: int, parameters: BlunderParameters
) -> float:
    """Return the p-value of the distance of a left-out point from its prediction."""
    image, (c, s) = block.images[view], view
    X = current.block.placements[s](image.control_mm[i : i + 1])
    pixels, by_parameter, _ = project_with_derivatives(current.block.cameras[c], X)
    v = (image.pixels[i] - pixels[0]) / image.sd_px[i]
    if not np.all(np.isfinite(v)):
        return 0.0
    # Only the camera's uncertainty is propagated; with the placement's the test would reject fewer points.
    names = [n for n in current.names if n.startswith(f"{c}:")]
    columns = [current.names.index(n) for n in names]
    A = by_parameter[0][:, [PARAMETER_NAMES.index(n.split(":")[1]) for n in names]] / image.sd_px[i]
    S = np.eye(2) + A @ current.cofactor[np.ix_(columns, columns)] @ A.T
    if not np.all(np.isfinite(S)):  # the adjustment does not determine the camera, and so predicts nothing
        return 0.0
    variance = max(current.sigma0, _floor(block, parameters)) ** 2
    return _f_p_value(float(v @ np.linalg.solve(S, v)) / 2 / variance, current.block.dof)


def _remove_worst(
    block: Block, current: BundleAdjustment, kept: Masks, parameters: BlunderParameters
) -> tuple[BundleAdjustment, Masks]:
    """Return the adjustment and the points kept after those rejected by their residuals were removed one by one."""
    n_points = sum(map(len, block.images.values()))
    limit = 1 if n_points <= parameters.max_exact_points else n_points
    while current.block.dof > _MIN_TEST_DOF and current.is_determined:
        rejected = _rejected(current, parameters, parameters.significance / n_points, limit)
        if not rejected:
            break
        removed = kept
        for view, i in rejected:
            removed = _with(removed, view, int(np.nonzero(kept[view])[0][i]), value=False)
            _check_removed(removed, parameters)
        kept = removed
        current = adjust(_reduced(current.block, block, kept))
    return current, kept


def _rejected(
    adjustment: BundleAdjustment, parameters: BlunderParameters, level: float, limit: int
) -> list[tuple[ImageIndex, int]]:
    """Return image and index of at most ``limit`` points whose studentized residual is the largest and too improbable.

    After each, residuals and cofactors follow from the linearized adjustment without it, which differs by the square of
    the influence of one point.
    """
    views = [
        (view, i)
        for view in adjustment.block.observation_slices
        for i in range(len(adjustment.block.images[view]))
    ]
    weighted, hats = adjustment.weighted_residuals, adjustment.hat_blocks()
    v = np.concatenate([weighted[view] for view in adjustment.block.observation_slices])
    H = np.concatenate([hats[view] for view in adjustment.block.observation_slices])
    A = adjustment.jacobian.reshape(len(v), 2, -1)
    Q, dof = adjustment.cofactor, adjustment.block.dof
    total = adjustment.sigma0**2 * dof
    floor = _floor(adjustment.block, parameters) ** 2
    rejected: list[int] = []
    while dof > _MIN_TEST_DOF and len(rejected) < limit:
        redundancy = np.eye(2) - H
        testable = np.linalg.eigvalsh(redundancy)[:, 0] > _UNTESTABLE
        testable[rejected] = False
        if not testable.any():
            break
        T = np.full(len(v), -np.inf)
        T[testable] = np.sum(
            v[testable] * np.linalg.solve(redundancy[testable], v[testable, :, None])[..., 0], axis=1
        )
        worst = int(np.argmax(T))
        variance = max((total - T[worst]) / (dof - 2), floor)
        if _f_p_value(float(T[worst]) / 2 / variance, dof - 2) >= level:
            break
        rejected.append(worst)
        if len(rejected) < limit:
            B = Q @ A[worst].T
            S = np.linalg.inv(redundancy[worst])
            G = A @ B
            v, H = v + G @ S @ v[worst], H + G @ S @ np.swapaxes(G, 1, 2)
            Q = Q + B @ S @ B.T
        total, dof = total - float(T[worst]), dof - 2
    return [views[i] for i in rejected]


def _f_p_value(F: float, dof: int) -> float:
    """Return P(F(2, dof) > F), which has a closed form."""
    return float((1 + 2 * F / dof) ** (-dof / 2))


def _check_removed(kept: Masks, parameters: BlunderParameters) -> None:
    """Raise `PoorFitError` when too many points of an image are removed."""
    for mask in kept.values():
        allowed = max(1, int(parameters.max_fraction * len(mask)))
        too_few = len(mask) >= parameters.min_kept and mask.sum() < parameters.min_kept
        if (~mask).sum() > allowed or too_few:
            raise PoorFitError(
                f"{int((~mask).sum())} of {len(mask)} points contradict the others; check that the control field is"
                " the one in the image and that points are named correctly"
            )


def _removed(block: Block, current: BundleAdjustment, kept: Masks) -> tuple[Blunder, ...]:
    out = []
    for (c, s), mask in sorted(kept.items()):
        image = block.images[c, s]
        camera, placement = current.block.cameras[c], current.block.placements[s]
        for i in np.nonzero(~mask)[0]:
            residual = image.pixels[i] - camera.project(placement(image.control_mm[i : i + 1]))[0]
            out.append(Blunder(c, s, image.ids[i], float(np.hypot(*residual))))
    return tuple(out)
