import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.rig_files.rig_json import rig_from_dict
from spinewatch.simulation.rigs import random_rig, table_3_3_rig
from tests.paths import DATA

SCENES = json.loads((DATA / "scene_projections.json").read_text())["scenes"]
seeds = st.integers(0, 2**32 - 1)
angles = st.floats(-180, 180)


@given(seeds)
def test_projecting_a_point_of_a_pixels_ray_gives_the_pixel_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng)
    for camera in (rig.left, rig.right):
        pixels = rng.uniform((0, 0), camera.image_size_px, (20, 2))
        points = camera.centre + rng.uniform(400, 1000, (20, 1)) * camera.directions(pixels)
        assert np.abs(camera.project(points) - pixels).max() < 1e-9


@given(seeds)
def test_a_ray_through_a_points_image_meets_the_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = random_rig(rng).left
    points = rng.uniform((300, 300, 0), (550, 480, 150), (20, 3))
    towards = points - camera.centre
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    assert np.abs(camera.directions(camera.project(points)) - towards).max() < 1e-12


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: s["rig"]["name"])
def test_projections_agree_with_rendered_scenes(scene: dict[str, Any]) -> None:
    rig = rig_from_dict(scene["rig"])
    balls = [ball for triad in scene["triads"] for ball in triad["balls"].values()]
    centres = [ball["center_mm"] for ball in balls]
    for side in ("left", "right"):
        projected = getattr(rig, side).project(centres)
        assert np.abs(projected - [ball[side] for ball in balls]).max() < 1e-6


@given(angles, angles, angles)
def test_rotation_is_the_product_of_three_turns(omega: float, phi: float, kappa: float) -> None:
    def turn(axis: Any, angle: float) -> Float:
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        M = np.eye(3)
        M[i, i] = M[j, j] = c
        M[i, j], M[j, i] = s, -s
        return M

    M = rotation_from_angles(omega, phi, kappa)
    assert np.allclose(M, turn(2, kappa) @ turn(1, phi) @ turn(0, omega), atol=1e-14)


@given(seeds)
def test_jacobians_are_the_derivatives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = random_rig(rng).right
    X = rng.uniform((350, 320, 50), (500, 460, 130))
    step = 1e-4 * np.eye(3)
    numeric = (camera.project(X + step) - camera.project(X - step)).T / 2e-4
    assert np.allclose(camera.projection_jacobian(X), numeric, atol=1e-6)
    u = camera.project(X)
    step = 1e-3 * np.eye(2)
    ideal = camera.undistort(camera.plate(u + step)) - camera.undistort(camera.plate(u - step))
    assert np.allclose(camera.undistortion_jacobian(u), ideal.T / 2e-3, atol=1e-9)


def test_points_behind_the_camera_have_no_image() -> None:
    camera = table_3_3_rig().left
    behind = camera.centre + 100 * camera.M[2]
    assert np.isnan(camera.project(behind)).all()


def test_an_integer_pixel_is_a_pixel_centre() -> None:
    camera = table_3_3_rig().left
    assert camera.plate((283.5, 207.5)) == pytest.approx((0, 0))
    assert camera.plate((284.5, 208.5)) == pytest.approx((0.01, -0.00845))


def test_the_thesis_rig_has_the_thesis_geometry() -> None:
    rig = table_3_3_rig()
    assert rig.baseline_mm == pytest.approx(422, abs=0.5)
    assert rig.vergence_deg == pytest.approx(32, abs=0.5)
