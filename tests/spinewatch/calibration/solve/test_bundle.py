from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.bundle import adjust, rms
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, camera_from_vector, camera_vector
from tests.spinewatch.calibration.simulated import (
    FIELD,
    IDENTITY,
    TABLE_3_3,
    WIDE,
    image,
    moved_board,
    one_camera,
    parameter_error,
)

FREE = (*EXTERIOR_NAMES, "f", "x0", "y0", "K1")


def stereo_block(sigma_px: float, tilt_deg: float = 4.0) -> Block:
    placements = (IDENTITY, moved_board(5, tilt_deg))
    images = {
        (c, s): image(camera, placement=placement, sigma_px=sigma_px, seed=2 * c + s)
        for c, camera in enumerate((TABLE_3_3.left, TABLE_3_3.right))
        for s, placement in enumerate(placements)
    }
    return Block((TABLE_3_3.left, TABLE_3_3.right), placements, images, (FREE, FREE))


def test_cameras_and_placement_are_recovered_from_wrong_initial_values() -> None:
    block = stereo_block(0.0)
    cameras = tuple(
        replace(c, focal_length_mm=1.03 * c.focal_length_mm, radial=(0.0, 0.0)) for c in block.cameras
    )
    found = adjust(replace(block, cameras=cameras, placements=(IDENTITY, IDENTITY)))
    assert found.rms_px < 1e-8
    assert parameter_error(found.block.cameras[0], TABLE_3_3.left) < 1e-5
    assert np.allclose(
        found.block.placements[1].translation_mm, block.placements[1].translation_mm, atol=1e-5
    )


def test_the_minimum_is_that_of_a_general_solver_with_numeric_derivatives() -> None:
    points = image(WIDE.left, FIELD.ids, sigma_px=0.2)
    found = adjust(one_camera(WIDE.left, points, FREE))

    def residuals(v: Float) -> Float:
        vector = camera_vector(WIDE.left)
        vector[:10] = v
        return np.asarray(
            (camera_from_vector(vector, WIDE.left).project(points.control_mm) - points.pixels).ravel()
        )

    start = camera_vector(WIDE.left)[:10]
    scale = np.array([1, 1, 1, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01, 1e-3])
    peer = least_squares(residuals, start, x_scale=scale, xtol=1e-12, ftol=1e-14, gtol=1e-14)
    assert found.rms_px**2 * 60 <= 2 * peer.cost * (1 + 1e-6)
    J = np.asarray(peer.jac, dtype=np.float64)
    sd = np.sqrt(np.diag(np.linalg.inv(J.T @ J)) * 2 * peer.cost / 50)
    assert np.allclose(list(found.camera_sd(0).values()), sd, rtol=1e-2)


def test_residuals_are_measured_less_computed_and_their_size_is_stated() -> None:
    found = adjust(stereo_block(0.1))
    for (c, s), residuals in found.residuals_px.items():
        points = found.block.images[c, s]
        computed = found.block.cameras[c].project(found.block.placements[s](points.control_mm))
        assert np.allclose(residuals, points.pixels - computed, atol=1e-9)
    total = sum((r**2).sum() for r in found.residuals_px.values())
    assert found.sigma0 == pytest.approx(np.sqrt(total / found.block.dof))
    assert found.rms_px == pytest.approx(np.sqrt(total / found.block.n_observations))
    assert found.sigma0 == pytest.approx(0.1, rel=0.3)


def test_the_hat_matrix_has_the_trace_of_the_unknowns() -> None:
    found = adjust(stereo_block(0.1))
    trace = sum(np.trace(H, axis1=1, axis2=2).sum() for H in found.hat_blocks().values())
    assert trace == pytest.approx(found.block.n_unknowns)


def test_correlations_are_within_one_and_one_on_the_diagonal() -> None:
    C = adjust(stereo_block(0.1)).correlation
    assert np.allclose(np.diag(C), 1)
    assert np.abs(C).max() <= 1 + 1e-9


def test_a_robust_adjustment_is_hardly_changed_by_a_blunder() -> None:
    offsets = np.zeros((30, 2))
    offsets[7] = 15.0
    clean, faulty = (
        one_camera(WIDE.left, image(WIDE.left, FIELD.ids, sigma_px=0.05, offsets_px=o), FREE)
        for o in (0.0, offsets)
    )
    true = WIDE.left.project(FIELD.points_mm)

    def error(block: Block, robust_scale: float | None) -> float:
        camera = adjust(block, robust_scale=robust_scale).block.cameras[0]
        return rms(camera.project(FIELD.points_mm) - true)

    assert error(faulty, 0.1) < 2 * error(clean, None) < 0.1 * error(faulty, None)


def test_angles_of_the_result_are_in_the_common_range() -> None:
    camera = WIDE.left
    omega, phi, kappa = camera.rotation_deg
    same = replace(camera, rotation_deg=(omega + 180, 180 - phi, kappa + 180))
    found = adjust(one_camera(same, image(camera, FIELD.ids), EXTERIOR_NAMES)).block.cameras[0]
    assert found.rotation_deg == pytest.approx(camera.rotation_deg, abs=1e-6)


def test_undetermined_unknowns_have_no_covariance_and_lost_points_are_an_error() -> None:
    few = adjust(one_camera(WIDE.left, image(WIDE.left, FIELD.ids[:3]), FREE))
    assert not few.is_determined
    assert np.isnan(few.sigma0)
    x, y, z = WIDE.left.position_mm
    below = replace(WIDE.left, position_mm=(x, y, -z))
    with pytest.raises(ConvergenceError, match="in view"):
        adjust(one_camera(below, image(WIDE.left, FIELD.ids), FREE))
    with pytest.raises(ConvergenceError):
        adjust(Block((WIDE.left,), (IDENTITY,), {}, (FREE,)))
