"""Reduced observation equations and their solution agree with the dense ones."""

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve import blunders, bundle
from spinewatch.calibration.solve.parameterization import Parameterization, linearize
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.solve.reduced_equations import Evaluation, minimize, reduced
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import table_3_3_rig

RIG = table_3_3_rig()
SENSORS = (Sensor.of_camera(RIG.left), Sensor.of_camera(RIG.right))


def planes(n_shots: int = 5, columns: int = 14, rows: int = 10, wrong: int = 3) -> list[Shot]:
    """Return shots of a plane of 140 points, some of them grossly wrong."""
    rng = np.random.default_rng(0)
    r, c = np.indices((rows, columns))
    X = np.stack([20.0 * c, 20.0 * r, 0.0 * r], axis=-1).reshape(-1, 3)
    ids = [str(i) for i in range(len(X))]
    shots = []
    for k in range(n_shots):
        R = rotation_from_angles(*rng.uniform(-25, 25, 3))
        placement = RigidTransform(R, np.array([430.0, 380.0, 30.0]) - R @ X.mean(axis=0))
        images = []
        for camera in (RIG.left, RIG.right):
            pixels = camera.project(placement(X)) + 0.1 * rng.standard_normal((len(X), 2))
            pixels[rng.choice(len(X), wrong, replace=False)] += 4.0
            images.append(ImagePoints.build(ids, X, pixels))
        shots.append(Shot(str(k), *images))
    return shots


@pytest.fixture(scope="module")
def shots() -> list[Shot]:
    return planes()


def test_reduction_keeps_normal_equations_and_sum_of_squares(shots: list[Shot]) -> None:
    block = calibrate_stereo(shots, SENSORS, SolveParameters(check_orientation=False)).adjustment.block
    p = Parameterization.of(block)
    at = linearize(p, p.pack())
    J, r = reduced(block, at.jacobian, at.residuals)
    assert len(J) < len(at.jacobian) / 5
    np.testing.assert_allclose(J.T @ J, at.jacobian.T @ at.jacobian, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(J.T @ r, at.jacobian.T @ at.residuals, rtol=1e-6, atol=1e-4)
    assert r @ r == pytest.approx(at.residuals @ at.residuals)


def test_a_large_block_is_solved_as_a_small_one(shots: list[Shot], monkeypatch: pytest.MonkeyPatch) -> None:
    parameters = SolveParameters(check_orientation=False)
    fast = calibrate_stereo(shots, SENSORS, parameters)
    monkeypatch.setattr(bundle, "_MAX_DENSE_OBSERVATIONS", 10**9)
    dense = calibrate_stereo(shots, SENSORS, parameters)
    assert fast.rig.baseline_mm == pytest.approx(dense.rig.baseline_mm, rel=1e-8)
    assert fast.adjustment.rms_px == pytest.approx(dense.adjustment.rms_px, rel=1e-9)
    np.testing.assert_allclose(fast.adjustment.cofactor, dense.adjustment.cofactor, rtol=1e-4, atol=1e-12)
    assert [b.id for b in fast.blunders] == [b.id for b in dense.blunders]


def test_several_points_at_once_are_those_removed_one_by_one(shots: list[Shot]) -> None:
    found = []
    for max_exact_points in (400, 10**9):
        parameters = SolveParameters(
            check_orientation=False, blunders=blunders.BlunderParameters(max_exact_points=max_exact_points)
        )
        calibration = calibrate_stereo(shots, SENSORS, parameters)
        found.append({(b.camera, b.shot, b.id) for b in calibration.blunders})
    assert found[0] == found[1]
    assert len(found[0]) >= 30


def test_initial_values_out_of_view_are_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        minimize(lambda x: Evaluation(float("nan"), lambda: (np.eye(1), x)), np.ones(1), 1e-12, 10)


def test_the_limit_of_evaluations_is_reported() -> None:
    def banana(x: Float) -> Evaluation:
        r = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])
        return Evaluation(float(r @ r), lambda: (np.array([[-20 * x[0], 10.0], [-1.0, 0.0]]), r))

    assert not minimize(banana, np.array([-1.2, 1.0]), 1e-14, 4).converged
    end = minimize(banana, np.array([-1.2, 1.0]), 1e-14, 200)
    assert end.converged
    np.testing.assert_allclose(end.x, [1.0, 1.0], atol=1e-6)
