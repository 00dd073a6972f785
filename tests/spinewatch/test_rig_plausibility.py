import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.camera import Camera, Rig
from spinewatch.errors import RigError
from spinewatch.rig_plausibility import (
    check_measurable_rig,
    check_plausible_camera,
    check_plausible_rig,
    is_parallel,
    lens_problem,
    pixel_grid,
    sees_common_field,
    with_angles,
)
from spinewatch.simulation.rigs import angles_towards, converging_rig, large_rig, random_rig, table_3_3_rig

RIG = table_3_3_rig()


def both(change: Callable[[Camera], dict[str, Any]]) -> Rig:
    return Rig("changed", replace(RIG.left, **change(RIG.left)), replace(RIG.right, **change(RIG.right)))


def times(field: str, factor: float) -> Rig:
    return both(lambda camera: {field: tuple(factor * value for value in getattr(camera, field))})


def problem_of(rig: Rig) -> str:
    with pytest.raises(RigError) as caught:
        check_plausible_rig(rig)
    return str(caught.value)


@given(st.integers(0, 2**32 - 1))
def test_sound_rigs_pass(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    check_plausible_rig(rig)
    assert sees_common_field(rig)


@pytest.mark.parametrize("vergence_deg", [3.0, 10.0, 60.0, 110.0])
def test_any_sane_vergence_passes(vergence_deg: float) -> None:
    check_plausible_rig(converging_rig(400.0, vergence_deg))


def test_parallel_axes_pass_because_the_range_may_be_given() -> None:
    parallel = Rig("parallel", RIG.left, replace(RIG.right, rotation_deg=RIG.left.rotation_deg))
    check_plausible_rig(parallel)
    assert is_parallel(parallel)
    assert not sees_common_field(parallel)


def test_a_rig_whose_axes_meet_nowhere_measures_no_stage() -> None:
    check_measurable_rig(RIG)
    parallel = Rig("parallel", RIG.left, replace(RIG.right, rotation_deg=RIG.left.rotation_deg))
    with pytest.raises(RigError, match=r"right\.rotation_deg"):
        check_measurable_rig(parallel)


def test_a_rig_turned_as_a_whole_passes() -> None:
    half_turn = np.diag([-1.0, -1.0, 1.0])

    def turned(camera: Camera) -> dict[str, Any]:
        omega, phi, kappa = camera.rotation_deg
        x, y, z = half_turn @ camera.centre
        return {"position_mm": (x, y, z), "rotation_deg": (-omega, -phi, kappa + 180)}

    rig = both(turned)
    assert rig.vergence_deg == pytest.approx(RIG.vergence_deg)
    check_plausible_rig(rig)


@pytest.mark.parametrize(
    ("rig", "field", "cause"),
    [
        (times("pixel_size_mm", 1000), "left.pixel_size_mm", "micrometres"),
        (times("pixel_size_mm", 0.001), "left.pixel_size_mm", "metres"),
        (both(lambda _: {"pixel_size_mm": (0.01, 0.003)}), "left.pixel_size_mm", "ratio"),
        (both(lambda c: {"focal_length_mm": 100 * c.focal_length_mm}), "left.focal_length_mm", "pixels"),
        (both(lambda c: {"focal_length_mm": c.focal_length_mm / 1000}), "left.focal_length_mm", "metres"),
        (both(lambda _: {"focal_length_mm": 100.0}), "left.focal_length_mm", "field of view of 3.25 degrees"),
        (both(lambda _: {"principal_point_mm": (289.6, 198.3)}), "left.principal_point_mm", "pixels"),
        (both(lambda _: {"radial": (-0.09, 0.0)}), "left.radial", "fold"),
        (both(lambda _: {"radial": (0.18, 0.0)}), "left.radial", "per mm.2"),
        (both(lambda _: {"radial": (0.0, 0.0), "decentering": (0.2, 0.0)}), "left.decentering", "fold"),
        (times("rotation_deg", 10_000), "left.rotation_deg", "DDDMMSS"),
        (times("position_mm", 0.001), "right.position_mm", r"0.4219 mm, .*metres for mm"),
        (times("position_mm", 0.1), "right.position_mm", "centimetres for mm"),
        (times("position_mm", 1 / 25.4), "right.position_mm", "inches for mm"),
        (times("position_mm", 100), "right.position_mm", "another unit"),
        (Rig("twice", RIG.left, RIG.left), "right.position_mm", "need a baseline"),
        (Rig("exchanged", RIG.right, RIG.left), "right.position_mm", "exchanged"),
        (times("rotation_deg", np.pi / 180), "right.rotation_deg", "radians for degrees"),
        (times("rotation_deg", -1), "right.rotation_deg", "look away from each other"),
    ],
)
def test_implausible_rigs_are_refused_with_field_and_cause(rig: Rig, field: str, cause: str) -> None:
    problem = problem_of(rig)
    assert f"'{field}'" in problem
    assert re.search(cause, problem), problem


def test_cameras_that_look_up_are_refused() -> None:
    def up(camera: Camera) -> dict[str, Any]:
        omega, phi, kappa = camera.rotation_deg
        return {"rotation_deg": (omega + 180, phi, kappa)}

    assert "away from the origin of object space" in problem_of(both(up))


def test_one_camera_that_looks_away_is_refused() -> None:
    omega, phi, kappa = RIG.right.rotation_deg
    away = Rig("away", RIG.left, replace(RIG.right, rotation_deg=(omega + 180, phi, kappa)))
    assert "right.rotation_deg" in problem_of(away)


def test_cameras_whose_axes_pass_far_from_each_other_are_refused() -> None:
    omega, phi, kappa = RIG.right.rotation_deg
    rig = Rig("crossed", RIG.left, replace(RIG.right, rotation_deg=(omega + 30, phi, kappa)))
    assert "other camera sees" in problem_of(rig)


def test_cameras_on_opposite_sides_of_the_field_are_refused() -> None:
    assert "vergence of 150.0 degrees" in problem_of(converging_rig(400.0, 150.0))


def test_axes_that_meet_at_the_cameras_are_refused() -> None:
    left = large_rig().left
    meet = left.centre - 60 * left.M[2]
    x, y, z = np.add(meet, (350.0, 0.0, 80.0))
    right = replace(left, position_mm=(x, y, z), rotation_deg=angles_towards(np.array((x, y, z)), meet))
    assert "meet at a range" in problem_of(Rig("near", left, right))


@pytest.mark.parametrize("scale", [0.5, 0.6, 0.7, 1.3, 1.5, 3.0])
def test_a_principal_point_of_another_image_size_is_found(scale: float) -> None:
    camera = large_rig().left
    u, v = scale * np.array(camera.pixels(camera.principal_point_mm))
    moved = replace(camera, principal_point_mm=tuple(camera.plate((u, v))))
    field, problem = lens_problem(moved) or ("", "")
    assert field == "principal_point_mm"
    assert f"{2 * round(u)} x {2 * round(v)}" in problem


@given(st.floats(-0.2, 0.2), st.floats(-0.09, 0.09))
def test_a_principal_point_off_the_centre_passes(x: float, y: float) -> None:
    camera = large_rig().left
    (w, h), (px, py) = camera.image_size_px, camera.pixel_size_mm
    check_plausible_camera(replace(camera, principal_point_mm=(x * w * px, y * h * py)), "left")


def test_another_reading_of_the_angles_is_applied_to_both_cameras() -> None:
    radians = with_angles(RIG, np.radians)
    assert is_parallel(radians)
    again = with_angles(radians, np.degrees)
    assert again.right.rotation_deg == pytest.approx(RIG.right.rotation_deg)


def test_the_grid_has_the_corners_of_the_image() -> None:
    grid = pixel_grid((5, 3), 2)
    assert grid.tolist() == [[0, 0], [4, 0], [0, 2], [4, 2]]
