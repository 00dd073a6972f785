import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.spine.curve_attribution import cobb_shares

seeds = st.integers(0, 2**32 - 1)


def z(azimuth: float, tilt: float) -> Float:
    """A unit vector that leans by ``tilt`` towards ``azimuth``."""
    a, t = np.radians([azimuth, tilt])
    return np.array([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)])


def cobb(upper: Float, lower: Float) -> float:
    return float(np.degrees(np.arctan2(-lower[1], lower[2]) - np.arctan2(-upper[1], upper[2])))


def directions(seed: int, count: int) -> Float:
    rng = np.random.default_rng(seed)
    return np.array([z(rng.uniform(-180, 180), rng.uniform(1, 40)) for _ in range(count)])


def test_straightening_in_the_coronal_plane_is_distraction_alone() -> None:
    shares = cobb_shares(z(90, 30), z(90, -30), z(90, 10), z(90, -10))
    assert shares == pytest.approx([-40.0, 0.0, -40.0, 0.0])


def test_unequal_straightening_of_both_ends_is_nearly_distraction_alone() -> None:
    total, rotation, distraction, tilt = cobb_shares(z(90, 30), z(90, -20), z(90, 10), z(90, -20))
    assert (total, rotation) == pytest.approx((-20.0, 0.0))
    assert distraction == pytest.approx(-20.0, abs=0.1)
    assert total == pytest.approx(rotation + distraction + tilt)


def test_by_hand_with_both_causes() -> None:
    # Small angles: Cobb = size sin(azimuth). From 2 degrees at 90 to 1 degree at 30: the mean size is 1.5, the mean
    # sine 0.75; rotation 1.5 (0.5 - 1) = -0.75, distraction (1 - 2) 0.75 = -0.75.
    shares = cobb_shares(z(90, 1), z(90, -1), z(30, 0.5), z(30, -0.5))
    assert shares == pytest.approx([-1.5, -0.75, -0.75, 0.0], abs=1e-3)


@settings(deadline=None)
@given(seeds, st.floats(-170, 170))
def test_a_rigid_turn_about_the_patients_axis_is_rotation_alone(seed: int, angle: float) -> None:
    upper, lower = directions(seed, 2)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    total, rotation, distraction, tilt = cobb_shares(upper, lower, R @ upper, R @ lower)
    assert total == pytest.approx(cobb(R @ upper, R @ lower) - cobb(upper, lower), abs=1e-9)
    assert rotation == pytest.approx(total, abs=1e-9)
    assert (distraction, tilt) == pytest.approx((0.0, 0.0), abs=1e-9)


@settings(deadline=None)
@given(seeds)
def test_the_parts_add_up_and_stages_may_change_places(seed: int) -> None:
    a, b, c, d = directions(seed, 4)
    shares = cobb_shares(a, b, c, d)
    assert shares[0] == pytest.approx(cobb(c, d) - cobb(a, b), abs=1e-9)
    assert shares[1:].sum() == pytest.approx(shares[0], abs=1e-9)
    assert cobb_shares(c, d, a, b) == pytest.approx(-shares, abs=1e-9)
    assert cobb_shares(a, b, a, b) == pytest.approx(np.zeros(4), abs=1e-9)


@settings(deadline=None)
@given(seeds)
def test_a_mirror_flips_every_part(seed: int) -> None:
    vectors = directions(seed, 4)
    mirrored = vectors * [1, -1, 1]
    assert cobb_shares(*mirrored) == pytest.approx(-cobb_shares(*vectors), abs=1e-9)


def test_leading_dimensions_are_a_batch() -> None:
    vectors = directions(1, 24).reshape(4, 6, 3)
    found = cobb_shares(*vectors)
    assert found.shape == (6, 4)
    assert found[2] == pytest.approx(cobb_shares(*vectors[:, 2]))
