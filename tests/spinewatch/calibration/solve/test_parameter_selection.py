from dataclasses import replace

import numpy as np
import pytest

from spinewatch.calibration.errors import UndeterminedError
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, PARAMETER_NAMES, camera_vector
from spinewatch.calibration.solve.determinability import DeterminabilityParameters
from spinewatch.calibration.solve.parameter_selection import (
    BASE_NAMES,
    corrected_akaike,
    free_names,
    select_parameters,
)
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.camera import Camera
from tests.spinewatch.calibration.simulated import FIELD, WIDE, WIDE_SENSOR, image, one_camera

PARAMETERS = SolveParameters()


def selected(
    points: ImagePoints, camera: Camera = WIDE.left, parameters: SolveParameters = PARAMETERS
) -> BundleAdjustment:
    start = adjust(one_camera(camera, points, BASE_NAMES[:7]))
    return select_parameters(start, parameters, WIDE_SENSOR, "the camera")


def test_free_names_are_in_order_and_not_fixed() -> None:
    parameters = SolveParameters(fixed={"x0": 0.0})
    assert free_names(("K1", "x0", "f", "X0"), parameters) == ("X0", "f", "K1")


def test_the_base_is_selected_for_a_lens_with_k1_alone() -> None:
    chosen = [
        selected(image(WIDE.left, FIELD.ids, sigma_px=0.05, seed=seed)).block.free[0] for seed in range(10)
    ]
    assert sum(free == BASE_NAMES for free in chosen) >= 6


def test_decentering_that_shows_is_selected() -> None:
    camera = replace(WIDE.left, decentering=(2e-3, -1.5e-3))
    free = selected(image(camera, FIELD.ids, sigma_px=0.02), camera).block.free[0]
    assert {"P1", "P2"} <= set(free)


def test_parameters_that_the_points_do_not_determine_are_held_at_zero() -> None:
    points = image(WIDE.left, FIELD.ids, sigma_px=0.05)
    for strict, held in (
        (DeterminabilityParameters(principal_point=1e-6), {"x0", "y0"}),
        (DeterminabilityParameters(distortion=1e-6), {"K1"}),
        (DeterminabilityParameters(principal_point=1e-6, distortion=1e-6), {"x0", "y0", "K1"}),
    ):
        block = selected(points, parameters=SolveParameters(determinability=strict)).block
        assert set(BASE_NAMES) - set(block.free[0]) == held
        vector = camera_vector(block.cameras[0])
        assert all(vector[PARAMETER_NAMES.index(name)] == 0 for name in held)
    strict = DeterminabilityParameters(1e-9, 1e-9, 1e-9)
    with pytest.raises(UndeterminedError, match="the camera: the points do not determine f"):
        selected(points, parameters=SolveParameters(determinability=strict))


def test_given_parameters_are_adjusted_or_refused() -> None:
    points = image(WIDE.left, FIELD.ids, sigma_px=0.05)
    given = SolveParameters(free=(*EXTERIOR_NAMES, "f", "K2"), estimate_aspect=True, fixed={"f": 7.0})
    assert selected(points, parameters=given).block.free[0] == (*EXTERIOR_NAMES, "K2", "aspect")
    with pytest.raises(UndeterminedError):
        selected(points.keep(np.arange(30) < 4), parameters=SolveParameters(free=BASE_NAMES))


def test_the_criterion_penalizes_parameters_that_do_not_reduce_the_residuals() -> None:
    exact = image(WIDE.left, FIELD.ids)
    few, many = (
        corrected_akaike(adjust(one_camera(WIDE.left, exact, names)))
        for names in (BASE_NAMES[:6], (*BASE_NAMES[:6], "K2"))
    )
    assert few < many
    n, k = 60, 7
    noisy = adjust(one_camera(WIDE.left, image(WIDE.left, FIELD.ids, sigma_px=0.1), BASE_NAMES[:6]))
    rss = sum((w * w).sum() for w in noisy.weighted_residuals.values())
    expected = n * np.log(rss / n + 1e-12) + 2 * k + 2 * k * (k + 1) / (n - k - 1)
    assert corrected_akaike(noisy) == pytest.approx(expected)
