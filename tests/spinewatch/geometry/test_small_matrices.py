import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.geometry.small_matrices import inverse_2x2, inverse_3x3

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_the_inverse_of_two_by_two_undoes_the_matrix(seed: int) -> None:
    A = np.random.default_rng(seed).normal(size=(3, 5, 2, 2)) + 4 * np.eye(2)
    assert np.allclose(inverse_2x2(A) @ A, np.eye(2))


@given(seeds)
def test_the_inverse_of_three_by_three_undoes_the_matrix(seed: int) -> None:
    A = np.random.default_rng(seed).normal(size=(7, 3, 3)) + 6 * np.eye(3)
    inverse, determinant = inverse_3x3(np.ascontiguousarray(np.moveaxis(A, 0, 2)))
    assert np.allclose(np.moveaxis(inverse, 2, 0) @ A, np.eye(3))
    assert np.allclose(determinant, np.linalg.det(A))


def test_singular_matrices_have_no_finite_inverse() -> None:
    assert not np.isfinite(inverse_2x2(np.zeros((2, 2)))).any()
    inverse, determinant = inverse_3x3(np.ones((3, 3, 1)))
    assert not np.isfinite(inverse).any()
    assert determinant.tolist() == [0.0]


def test_no_matrices_have_no_inverses() -> None:
    assert inverse_2x2(np.empty((0, 2, 2))).shape == (0, 2, 2)
    assert inverse_3x3(np.empty((3, 3, 0)))[0].shape == (3, 3, 0)
