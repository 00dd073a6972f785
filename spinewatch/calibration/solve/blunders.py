"""Blunders: points that contradict the others, found by robust adjustment and named."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.calibration.errors import PoorFitError
from spinewatch.calibration.solve.bundle import Block, BundleAdjustment, ImageIndex, adjust, hat_blocks
from spinewatch.calibration.solve.collinearity import NAMES, project_with_derivatives

_MAD = 1.4826


@dataclass(frozen=True)
class BlunderParameters:
    """When a point counts as a blunder.

    ``significance`` of the test, shared among all points (Bonferroni): the share of sound calibrations that lose
    a point. Simulated, 1% leaves fewer blunders and better cameras than 0.1%, and 5% takes good points
    (docs/calibration.md). ``floor_px`` below which no residual is suspicious, however small the others;
    ``readmission`` probability that a suspect's miss must have to be taken back; ``most`` the greatest fraction
    of points that may be removed.
    """

    significance: float = 0.01
    readmission: float = 0.01
    floor_px: float = 0.05
    most: float = 0.25
    enabled: bool = True


@dataclass(frozen=True)
class Blunder:
    """A removed point: its ``camera`` and ``placement`` index, ``id``, and how far it lies off, px."""

    camera: int
    placement: int
    id: str
    miss_px: float


def adjust_without_blunders(
    block: Block, parameters: BlunderParameters
) -> tuple[BundleAdjustment, tuple[Blunder, ...]]:
    """Return the adjustment of the points that agree with each other, and those that were removed.

    A robust adjustment (Cauchy's loss) points out suspects, so that several blunders cannot hide each other;
    each is taken back unless an F-test of its prediction rejects it; then the remaining points are tested one
    at a time by their studentized residuals, the worst first. Raises ``PoorFitError`` when more than the
    permitted fraction would have to go.
    """
    first = adjust(block)
    if not parameters.enabled or first.block.redundancy <= 2:
        return first, ()
    kept = {view: np.ones(len(image), dtype=bool) for view, image in block.images.items()}
    current = first
    if _looks_contaminated(first, parameters):
        robust = adjust(first.block, robust_px=2 * _robust_sigma(first, parameters))
        robust = adjust(robust.block, robust_px=2 * _robust_sigma(robust, parameters))
        kept = _unsuspected(robust, parameters)
        current = _take_back(block, adjust(_reduced(robust.block, block, kept)), kept, parameters)
    current = _remove_worst(block, current, kept, parameters)
    return current, _name(block, current, kept)


def _looks_contaminated(adjustment: BundleAdjustment, parameters: BlunderParameters) -> bool:
    worst = max(
        float(np.abs(r / adjustment.block.images[v].sd_px[:, None]).max()) for v, r in _residuals(adjustment)
    )
    return worst > 4 * _robust_sigma(adjustment, parameters)


def _residuals(adjustment: BundleAdjustment) -> list[tuple[ImageIndex, Float]]:
    return [(view, r) for view, r in adjustment.residuals_px.items() if len(r)]


def _floor(block: Block, parameters: BlunderParameters) -> float:
    sd = np.concatenate([image.sd_px for image in block.images.values()])
    return parameters.floor_px / float(np.median(sd))


def _robust_sigma(adjustment: BundleAdjustment, parameters: BlunderParameters) -> float:
    images = adjustment.block.images
    weighted = np.concatenate([(r / images[v].sd_px[:, None]).ravel() for v, r in _residuals(adjustment)])
    inflation = np.sqrt(len(weighted) / max(adjustment.block.redundancy, 1))
    return max(float(_MAD * np.median(np.abs(weighted)) * inflation), _floor(adjustment.block, parameters))


def _unsuspected(
    adjustment: BundleAdjustment, parameters: BlunderParameters
) -> dict[ImageIndex, NDArray[np.bool_]]:
    limit = 5 * _robust_sigma(adjustment, parameters)
    images = adjustment.block.images
    return {
        view: np.abs(r / images[view].sd_px[:, None]).max(axis=1) < limit
        for view, r in adjustment.residuals_px.items()
    }


def _reduced(at: Block, full: Block, kept: dict[ImageIndex, NDArray[np.bool_]]) -> Block:
    return replace(at, images={view: image.keep(kept[view]) for view, image in full.images.items()})


def _take_back(
    block: Block,
    current: BundleAdjustment,
    kept: dict[ImageIndex, NDArray[np.bool_]],
    parameters: BlunderParameters,
) -> BundleAdjustment:
    while True:
        best, at = parameters.readmission, None
        for view, mask in kept.items():
            for i in np.nonzero(~mask)[0]:
                p = _prediction_p(block, current, view, int(i), parameters)
                if p > best:
                    best, at = p, (view, int(i))
        if at is None:
            _refuse_many(block, kept, parameters)
            return current
        kept[at[0]][at[1]] = True
        current = adjust(_reduced(current.block, block, kept))


def _prediction_p(
    block: Block, current: BundleAdjustment, view: ImageIndex, i: int, parameters: BlunderParameters
) -> float:
    """Return the probability of a left-out point lying as far from its prediction as it does."""
    image = block.images[view]
    camera, placement = current.block.cameras[view[0]], current.block.placements[view[1]]
    pixels, by_camera, _ = project_with_derivatives(camera, placement(image.control_mm[i : i + 1]))
    v = (image.pixels[i] - pixels[0]) / image.sd_px[i]
    if not np.all(np.isfinite(v)):
        return 0.0
    # Only the camera's own uncertainty is carried; a placement's would make the test milder still.
    names = [n for n in current.names if n.startswith(f"{view[0]}:")]
    columns = [current.names.index(n) for n in names]
    A = by_camera[0][:, [NAMES.index(n.split(":")[1]) for n in names]] / image.sd_px[i]
    S = np.eye(2) + A @ current.cofactor[np.ix_(columns, columns)] @ A.T
    freedom = current.block.redundancy
    variance = max(current.sigma0, _floor(block, parameters)) ** 2
    return _f_tail(float(v @ np.linalg.solve(S, v)) / 2 / variance, freedom)


def _remove_worst(
    block: Block,
    current: BundleAdjustment,
    kept: dict[ImageIndex, NDArray[np.bool_]],
    parameters: BlunderParameters,
) -> BundleAdjustment:
    points = sum(map(len, block.images.values()))
    while current.block.redundancy > 4 and np.all(np.isfinite(current.cofactor)):
        p, view, i = _least_likely(current, parameters)
        if p >= parameters.significance / points:
            break
        kept[view][np.nonzero(kept[view])[0][i]] = False
        _refuse_many(block, kept, parameters)
        current = adjust(_reduced(current.block, block, kept))
    return current


def _least_likely(
    adjustment: BundleAdjustment, parameters: BlunderParameters
) -> tuple[float, ImageIndex, int]:
    freedom = adjustment.block.redundancy
    total = adjustment.sigma0**2 * freedom
    floor = _floor(adjustment.block, parameters) ** 2
    worst: tuple[float, ImageIndex, int] = (1.0, (0, 0), 0)
    for view, H in hat_blocks(adjustment).items():
        v = adjustment.residuals_px[view] / adjustment.block.images[view].sd_px[:, None]
        rest = np.eye(2) - H
        testable = np.linalg.eigvalsh(rest)[:, 0] > 1e-6
        for i in np.nonzero(testable)[0]:
            T = float(v[i] @ np.linalg.solve(rest[i], v[i]))
            variance = max((total - T) / (freedom - 2), floor)
            p = _f_tail(T / 2 / variance, freedom - 2)
            if p < worst[0]:
                worst = (p, view, int(i))
    return worst


def _f_tail(F: float, freedom: int) -> float:
    """Return P(F(2, freedom) > F), which has a closed form."""
    return float((1 + 2 * F / freedom) ** (-freedom / 2))


def _refuse_many(
    block: Block, kept: dict[ImageIndex, NDArray[np.bool_]], parameters: BlunderParameters
) -> None:
    for mask in kept.values():
        allowed = max(1, int(parameters.most * len(mask)))
        if (~mask).sum() > allowed or (len(mask) >= 6 and mask.sum() < 6):
            raise PoorFitError(
                f"{int((~mask).sum())} of {len(mask)} points contradict the others; check that the control field is"
                " the one in the picture and that points are named right"
            )


def _name(
    block: Block, current: BundleAdjustment, kept: dict[ImageIndex, NDArray[np.bool_]]
) -> tuple[Blunder, ...]:
    out = []
    for view, mask in sorted(kept.items()):
        image = block.images[view]
        camera, placement = current.block.cameras[view[0]], current.block.placements[view[1]]
        for i in np.nonzero(~mask)[0]:
            miss = image.pixels[i] - camera.project(placement(image.control_mm[i : i + 1]))[0]
            out.append(Blunder(view[0], view[1], image.ids[i], float(np.hypot(*miss))))
    return tuple(out)
