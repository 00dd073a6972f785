"""Coordinate systems: the clinical page's formulas, handedness, and bodies that stay upright."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exports.coordinates import (
    GLTF_FROM_PATIENT,
    LPS_FROM_PATIENT,
    RAS_FROM_PATIENT,
    inverse,
    point,
    transform,
)
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector

AXES = (LPS_FROM_PATIENT, RAS_FROM_PATIENT, GLTF_FROM_PATIENT)
numbers = st.floats(-3, 3)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)


def test_formulas() -> None:
    x, y, z = place = np.array([1.0, 2.0, 3.0])
    assert point(LPS_FROM_PATIENT, place).tolist() == [y, -x, z]
    assert point(RAS_FROM_PATIENT, place).tolist() == [-y, x, z]
    assert point(GLTF_FROM_PATIENT, place).tolist() == [y, z, x]


@pytest.mark.parametrize("axes", AXES)
def test_every_system_is_right_handed(axes: Float) -> None:
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_array_equal(axes @ axes.T, np.eye(3))


@pytest.mark.parametrize("axes", AXES)
def test_an_upright_body_has_the_identity_as_its_rotation(axes: Float) -> None:
    np.testing.assert_array_equal(transform(axes, np.eye(3), np.zeros(3)), np.eye(4))


@pytest.mark.parametrize("axes", AXES)
@given(vectors, vectors, vectors)
def test_a_point_moves_alike_in_every_system(axes: Float, turn: Float, shift: Float, place: Float) -> None:
    R = rotation_from_vector(turn)
    moved = transform(axes, R, shift) @ np.append(axes @ place, 1.0)
    np.testing.assert_allclose(moved[:3], axes @ (R @ place + shift), atol=1e-12)


@given(vectors, vectors)
def test_inverse(turn: Float, shift: Float) -> None:
    matrix = transform(LPS_FROM_PATIENT, rotation_from_vector(turn), shift)
    np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(4), atol=1e-12)
