from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.kinematic_chain import Link, chain_poses
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation

seeds = st.integers(0, 2**32 - 1)


def random_link(rng: np.random.Generator, n: int, inverted: bool = False) -> Link:
    return Link(rng.uniform(-200, 200, (n, 3)), rotation_from_vector(rng.uniform(-2, 2, (n, 3))), inverted)


def matrix(position: Float, rotation: Float) -> Float:
    M = np.eye(4)
    M[:3, :3], M[:3, 3] = rotation, position
    return M


def disturbed(link: Link, error: Float) -> Link:
    turned = rotation_from_vector(np.radians(error[3:])) @ link.rotation
    return Link(link.position_mm + error[:3], turned, link.inverted)


@settings(deadline=None, max_examples=30)
@given(seeds)
def test_a_chain_is_the_product_of_homogeneous_matrices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    links = [random_link(rng, 2, inverted) for inverted in (False, True, False, True)]
    last = random_link(rng, 2)
    result = chain_poses(links, last.position_mm, last.rotation)
    for i in range(2):
        M = np.eye(4)
        for link in links:
            own = matrix(link.position_mm[i], link.rotation[i])
            M = M @ (np.linalg.inv(own) if link.inverted else own)
        expected = M @ matrix(last.position_mm[i], last.rotation[i])
        assert np.allclose(result.position_mm[i], expected[:3, 3], atol=1e-9)
        assert np.allclose(result.rotation[i], expected[:3, :3], atol=1e-12)


def test_a_quarter_turn_by_hand() -> None:
    quarter = np.array([[[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]])
    turn = Link(np.array([[10.0, 0, 0]]), quarter)
    result = chain_poses([turn], np.array([[2.0, 0, 0]]), np.eye(3)[None])
    assert np.allclose(result.position_mm, [[10, 2, 0]])
    assert np.allclose(result.rotation, quarter)
    # A degree about z moves the point, 2 mm in +y of the link, by 2 pi / 180 mm in -x.
    assert np.allclose(result.by_link[0][0, :3, 5], [-2 * np.pi / 180, 0, 0])
    inverse = chain_poses([Link(turn.position_mm, quarter, inverted=True)], np.array([[10.0, 2, 0]]), quarter)
    assert np.allclose(inverse.position_mm, [[2, 0, 0]])
    assert np.allclose(inverse.rotation, np.eye(3))


@settings(deadline=None, max_examples=30)
@given(seeds)
def test_jacobians_are_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    links = [random_link(rng, 1, inverted) for inverted in (False, True, False, True)]
    last = random_link(rng, 1)
    result = chain_poses(links, last.position_mm, last.rotation)
    step = 1e-5
    for number in range(len(links) + 1):
        J = result.by_last if number == len(links) else result.by_link[number]
        for column in range(6):
            error = step * np.eye(6)[column]
            moved, end = list(links), last
            if number == len(links):
                end = disturbed(last, error)
            else:
                moved[number] = disturbed(links[number], error)
            other = chain_poses(moved, end.position_mm, end.rotation)
            turn = np.degrees(vector_from_rotation(other.rotation[0] @ result.rotation[0].T))
            found = np.concatenate([other.position_mm[0] - result.position_mm[0], turn]) / step
            assert np.allclose(found, J[0, :, column], atol=1e-4)


def test_no_links_change_nothing() -> None:
    last = random_link(np.random.default_rng(1), 3)
    result = chain_poses([], last.position_mm, last.rotation)
    assert np.array_equal(result.position_mm, last.position_mm)
    assert np.array_equal(result.rotation, last.rotation)
    assert result.by_link == ()
    assert np.array_equal(result.by_last, np.tile(np.eye(6), (3, 1, 1)))


def test_links_of_another_number_are_refused() -> None:
    rng = np.random.default_rng(2)
    with pytest.raises(ValueError, match="operand"):
        chain_poses([random_link(rng, 2)], np.zeros((3, 3)), np.tile(np.eye(3), (3, 1, 1)))
