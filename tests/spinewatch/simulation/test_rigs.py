import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.simulation.rigs import (
    angles_towards,
    convergence_point,
    converging_rig,
    large_rig,
    perturbed_rig,
    random_rig,
    small_rig,
    table_3_3_rig,
)

seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize(
    ("rig", "baseline", "vergence"),
    [(small_rig(), 320, 24), (large_rig(), 420, 32), (converging_rig(350.0, 20.0), 350, 20)],
)
def test_configurations_have_their_geometry(rig: Rig, baseline: float, vergence: float) -> None:
    assert rig.baseline_mm == pytest.approx(baseline)
    assert rig.vergence_deg == pytest.approx(vergence)


def test_table_3_3_agrees_with_trial_c() -> None:
    rig = table_3_3_rig()
    assert rig.baseline_mm == pytest.approx(422, abs=0.5)
    assert rig.vergence_deg == pytest.approx(32, abs=0.5)


@given(seeds)
def test_random_rigs_show_the_measuring_volume_with_x_to_the_right(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    corners = np.array([[x, y, z] for x in (384, 484) for y in (350, 430) for z in (60, 120)], dtype=float)
    for camera in (rig.left, rig.right):
        uv = camera.project(corners)
        assert np.all((uv >= 0) & (uv < camera.image_size_px))
        assert np.all(uv[4:, 0] > uv[:4, 0])


def test_a_higher_resolution_keeps_the_width_of_the_sensor() -> None:
    coarse, fine = (converging_rig(420, 32, image_size_px=size).left for size in ((568, 416), (1136, 832)))
    point = np.array([400.0, 380.0, 90.0])
    assert fine.plate(fine.project(point)) == pytest.approx(coarse.plate(coarse.project(point)))
    assert fine.pixel_size_mm[0] == pytest.approx(coarse.pixel_size_mm[0] / 2)


@given(st.floats(-300, 300), st.floats(-300, 300), st.floats(100, 900))
def test_a_camera_points_at_its_target_with_object_x_to_the_right(x: float, y: float, z: float) -> None:
    M = rotation_from_angles(*angles_towards(np.array([x, y, z]), np.zeros(3)))
    target = M @ -np.array([x, y, z])
    assert target[:2] == pytest.approx([0, 0], abs=1e-9)
    assert target[2] < 0
    assert (M @ [1, 0, 0])[1] == pytest.approx(0, abs=1e-12)
    assert (M @ [1, 0, 0])[0] > 0


def test_a_perturbed_rig_has_small_errors_in_its_right_camera() -> None:
    rig, rng = large_rig(), np.random.default_rng(0)
    assert perturbed_rig(rig, rng, 0, 0) is rig
    other = perturbed_rig(rig, rng, 0.05, 0.1)
    assert other.left is rig.left
    assert 0 < np.linalg.norm(other.right.centre - rig.right.centre) < 0.6
    assert 0 < np.abs(other.right.M - rig.right.M).max() < 0.005


def test_perturbations_have_their_standard_deviations() -> None:
    rig, rng = large_rig(), np.random.default_rng(0)
    shifts = [
        rig.right.M @ (perturbed_rig(rig, rng, 0, 0.1).right.centre - rig.right.centre) for _ in range(400)
    ]
    assert np.std(shifts, axis=0) == pytest.approx([0.1, 0.1, 0.1], rel=0.15)


def test_both_axes_pass_the_convergence_point() -> None:
    rig = large_rig()
    target = convergence_point(rig)
    assert target == pytest.approx([434, 390, 90])
    for camera in (rig.left, rig.right):
        ideal = camera.M @ (target - camera.centre)
        assert np.abs(ideal[:2]).max() < 1e-9


def test_parallel_axes_have_no_convergence_point() -> None:
    rig = large_rig()
    parallel = Rig("parallel", rig.left, rig.left.moved(np.zeros(3), np.array([300.0, 0, 0])))
    with pytest.raises(ParameterError, match="parallel"):
        convergence_point(parallel)
