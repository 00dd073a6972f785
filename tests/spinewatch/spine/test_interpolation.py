from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.displacements import Base
from spinewatch.spine.interpolation import fill_rotations, other_interpolations
from spinewatch.spine.interpolation_model import InterpolationParameters
from tests.spinewatch.spine.simulated import turn

PLACES = np.array([0.0, 1.1, 2.0, 3.2, 4.0])
KNOTS, AT = [0, 2, 4], [1, 3]


def rotations(rng: np.random.Generator, size_deg: float) -> Float:
    return rotation_from_vector(np.radians(rng.normal(0, size_deg, (5, 3))))


def filled(rotation: Float, base: Float, errors: dict[str, Float], base_errors: dict[str, Float]) -> Float:
    return fill_rotations(
        rotation, errors, based(base, base_errors), "interpolation POST", InterpolationParameters()
    )


def based(
    rotation: Float, errors: dict[str, Float], position: Float | None = None, places: Float = PLACES
) -> Base:
    poses = SpinePoses(np.zeros((len(rotation), 3)) if position is None else position, rotation)
    return Base(poses, errors, places)


def without(values: Float) -> Float:
    known = values.copy()
    known[AT] = np.nan
    return known


def test_the_change_follows_scipys_rotation_spline() -> None:
    rng = np.random.default_rng(1)
    base, R = rotations(rng, 15), rotations(rng, 30)
    change = Rotation.from_matrix((R @ np.swapaxes(base, -1, -2))[KNOTS])
    expected = RotationSpline(PLACES[KNOTS], change)(PLACES[AT]).as_matrix() @ base[AT]
    result = filled(without(R), base, {}, {})
    assert np.allclose(result[AT], expected)
    assert np.array_equal(result[KNOTS], R[KNOTS])


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6))
def test_no_change_keeps_the_base(seed: int) -> None:
    base = rotations(np.random.default_rng(seed), 25)
    assert np.allclose(filled(without(base), base, {}, {}), base, atol=1e-12)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6))
def test_errors_are_finite_differences_where_changes_differ_little(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = rotations(rng, 15)
    R = rotation_from_vector(np.radians(rng.normal(0, 10, 3) + rng.normal(0, 3, (5, 3)))) @ base
    factor = rng.normal(0, 1, (5, 6, 1))
    factor[:, :3] = 0
    base_factor = np.zeros((5, 6, 1))
    base_factor[:, 3:] = rng.normal(0, 1, (5, 3, 1))
    errors = {"triads POST": factor.copy()}
    result = filled(without(R), base, errors, {"initial": base_factor})
    step = 1e-4

    def turned(matrices: Float, F: Float) -> Float:
        return rotation_from_vector(np.radians(step * F[:, 3:, 0])) @ matrices

    moved = filled(turned(without(R), factor), base, {}, {})
    found = np.degrees(vector_from_rotation(moved[AT] @ np.swapaxes(result[AT], -1, -2))) / step
    assert np.allclose(found, errors["triads POST"][AT, 3:, 0], atol=0.02)
    # An error of the initial pose of a knot turns with its motion and leaves the change as it is.
    carried = R @ np.swapaxes(base, -1, -2) @ base_factor[:, 3:]
    errors = {"initial": np.concatenate([np.zeros((5, 3, 1)), carried], axis=1)}
    filled(without(R), base, errors, {"initial": base_factor})
    moved = filled(turned(without(R), errors["initial"]), turned(base, base_factor), {}, {})
    found = np.degrees(vector_from_rotation(moved[AT] @ np.swapaxes(result[AT], -1, -2))) / step
    assert np.allclose(found, errors["initial"][AT, 3:, 0], atol=1e-3)


def test_the_others_bracket_by_slerp() -> None:
    rng = np.random.default_rng(2)
    base, R = rotations(rng, 10), rotations(rng, 20)
    position, base_position = rng.normal(0, 100, (2, 5, 3))
    measured = SpinePoses(without(position), without(R))
    filled_poses = SpinePoses(position, filled(without(R), base, {}, {}))
    absolute, change, spline = other_interpolations(measured, filled_poses, based(base, {}, base_position))
    assert np.allclose(
        absolute.rotation[AT], Slerp(PLACES[KNOTS], Rotation.from_matrix(R[KNOTS]))(PLACES[AT]).as_matrix()
    )
    changes = Rotation.from_matrix((R @ np.swapaxes(base, -1, -2))[KNOTS])
    assert np.allclose(change.rotation[AT], Slerp(PLACES[KNOTS], changes)(PLACES[AT]).as_matrix() @ base[AT])
    assert np.allclose(
        spline.rotation[AT],
        RotationSpline(PLACES[KNOTS], Rotation.from_matrix(R[KNOTS]))(PLACES[AT]).as_matrix(),
    )
    for axis in range(3):
        line = np.interp(PLACES[AT], PLACES[KNOTS], position[KNOTS, axis])
        assert np.allclose(absolute.position_mm[AT, axis], line)
        moved = np.interp(PLACES[AT], PLACES[KNOTS], (position - base_position)[KNOTS, axis])
        assert np.allclose(change.position_mm[AT, axis], base_position[AT, axis] + moved)
    for other in (absolute, change, spline):
        assert np.array_equal(other.rotation[KNOTS], R[KNOTS])
        assert np.array_equal(other.position_mm[KNOTS], position[KNOTS])


def test_half_way_between_two_by_hand() -> None:
    R = np.stack([np.eye(3), np.full((3, 3), np.nan), turn(0, 0, 40)])
    base = based(np.stack([np.eye(3)] * 3), {}, places=np.array([0.0, 1.0, 2.0]))
    result = fill_rotations(R, {}, base, "s", InterpolationParameters())
    assert np.allclose(result[1], turn(0, 0, 20))


def test_nothing_in_between_has_no_others() -> None:
    poses = SpinePoses(np.zeros((5, 3)), np.stack([np.eye(3)] * 5))
    assert other_interpolations(poses, poses, based(poses.rotation, {})) == ()
