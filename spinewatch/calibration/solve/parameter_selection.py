"""Selection of the interior parameters to adjust: those that the points determine and need."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.points import Sensor
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import (
    EXTERIOR_NAMES,
    PARAMETER_NAMES,
    camera_from_vector,
    camera_vector,
)
from spinewatch.calibration.solve.determinability import check_determined, undetermined
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.camera import Camera

BASE_NAMES = (*EXTERIOR_NAMES, "f", "x0", "y0", "K1")
"""The parameters that are adjusted unless the points do not determine them."""

_EXTENSIONS: tuple[tuple[str, ...], ...] = ((), ("K2",), ("P1", "P2"), ("K2", "P1", "P2"))
_REDUCTIONS: tuple[tuple[str, ...], ...] = (("K1",), ("x0", "y0"), ("x0", "y0", "K1"))
_LENS = ("x0", "y0", "K1", "K2", "P1", "P2")
_EXACT_PX = 1e-6


def free_names(names: Iterable[str], parameters: SolveParameters) -> tuple[str, ...]:
    """Return the names of parameters that are not fixed.

    Parameters
    ----------
    names
        Names in any order.
    parameters
        Which are fixed.

    Returns
    -------
    tuple of str
        Names in the order of `PARAMETER_NAMES`.
    """
    wanted = set(names) - set(parameters.fixed)
    return tuple(name for name in PARAMETER_NAMES if name in wanted)


def select_parameters(
    initial: BundleAdjustment, parameters: SolveParameters, sensor: Sensor, where: str
) -> BundleAdjustment:
    """Return the adjustment of one camera with the parameters that its points determine and need.

    K2 and the decentering are added to `BASE_NAMES` when the corrected Akaike criterion is smaller with them. When the
    base is not determined, K1 or the principal point or both are held at zero; at last only f is adjusted with the
    exterior orientation.

    Parameters
    ----------
    initial
        Adjustment to begin with.
    parameters
        ``free`` to give the parameters instead.
    sensor
        The sensor.
    where
        Name of the camera in error messages.

    Returns
    -------
    BundleAdjustment
        The adjustment; its ``block.free`` are the selected parameters.

    Raises
    ------
    UndeterminedError
        If the points do not determine the parameters given, or not even f.
    ConvergenceError
        If a camera does not have its points in view.

    References
    ----------
    N. Sugiura, Comm. Statist. A7 (1978) 13-26; K. P. Burnham, D. R. Anderson, Model Selection and Multimodel Inference
    (2002), section 2.4.
    """
    aspect = ("aspect",) if parameters.estimate_aspect else ()
    if parameters.free is not None:
        names = free_names((*parameters.free, *aspect), parameters)
        given = adjust(replace(initial.block, free=(names,)))
        if not given.is_determined:
            check_determined(given, sensor, where, parameters.determinability)
        return given
    extended = [{*BASE_NAMES, *more, *aspect} for more in _EXTENSIONS]
    reduced = [{*BASE_NAMES, *aspect} - set(fewer) for fewer in _REDUCTIONS]
    for candidates in (extended, reduced):
        if (best := _best_determined(initial, candidates, parameters, sensor)) is not None:
            return best
    minimal = adjust(replace(initial.block, free=(free_names((*EXTERIOR_NAMES, "f"), parameters),)))
    check_determined(minimal, sensor, where, parameters.determinability)
    return minimal


def _best_determined(
    initial: BundleAdjustment, candidates: Iterable[set[str]], parameters: SolveParameters, sensor: Sensor
) -> BundleAdjustment | None:
    """Return the adjustment of least criterion among candidates that the points determine, or None."""
    best, min_criterion = None, np.inf
    for candidate in candidates:
        names = free_names(candidate, parameters)
        camera = _without(initial.block.cameras[0], names, parameters)
        block = replace(initial.block, free=(names,), cameras=(camera,))
        if block.dof < 0 or (best is not None and block.dof < 2):
            continue
        try:
            adjusted = adjust(block)
        except ConvergenceError:
            continue
        if undetermined(adjusted, sensor, parameters.determinability):
            continue
        criterion = corrected_akaike(adjusted)
        if best is None or criterion < min_criterion:
            best, min_criterion = adjusted, criterion
    return best


def _without(camera: Camera, free: tuple[str, ...], parameters: SolveParameters) -> Camera:
    """Return the camera with lens parameters that are neither free nor fixed at zero."""
    vector = camera_vector(camera)
    for name in _LENS:
        if name not in free and name not in parameters.fixed:
            vector[PARAMETER_NAMES.index(name)] = 0.0
    return camera_from_vector(vector, camera)


def corrected_akaike(adjustment: BundleAdjustment) -> float:
    """Return the corrected Akaike information criterion of an adjustment.

    Parameters
    ----------
    adjustment
        The adjustment.

    Returns
    -------
    float
        ``n log(RSS / n) + 2 k + 2 k (k + 1) / (n - k - 1)`` of n observations and k - 1 unknowns; smaller is better.

    References
    ----------
    N. Sugiura, Comm. Statist. A7 (1978) 13-26.
    """
    n, k = adjustment.block.n_observations, adjustment.block.n_unknowns + 1
    square = float(sum((w * w).sum() for w in adjustment.weighted_residuals.values())) / n + _EXACT_PX**2
    small_sample = 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else np.inf
    return n * float(np.log(square)) + 2 * k + small_sample
