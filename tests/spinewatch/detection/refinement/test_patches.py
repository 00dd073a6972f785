"""Patches: whatever the camera's pixels, the same ball gives the same patch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.refinement.patches import PatchGrid, cut_patches, resampling

GRID = PatchGrid(25, 5.0)


@given(st.floats(2, 60))
def test_an_even_picture_stays_even_and_a_ramp_a_ramp(radius_px: float) -> None:
    matrix = resampling(radius_px, GRID)
    pixels = np.arange(matrix.shape[1]) - matrix.shape[1] // 2
    assert matrix.sum(axis=1) == pytest.approx(1, abs=1e-5)
    wanted = (np.arange(GRID.size) - GRID.size // 2) * radius_px / GRID.radius
    assert matrix @ pixels == pytest.approx(wanted, abs=0.03 * max(radius_px / GRID.radius, 1))


@settings(max_examples=25, deadline=None)
@given(st.floats(6, 30), st.floats(6, 30))
def test_balls_of_any_size_and_aspect_look_alike(width: float, height: float) -> None:
    def patch(w: float, h: float) -> NDArray[np.float32]:
        y, x = np.mgrid[-80:81, -80:81]
        # A shape finer than neither pixels nor samples.
        picture = np.exp(-0.5 * ((x / w * 2) ** 2 + (y / h * 2) ** 2)).astype(np.float32)
        return np.asarray(cut_patches(picture, np.array([[80, 80]]), (w, h), GRID)[0])

    assert patch(width, height) == pytest.approx(patch(10, 10), abs=0.06)


def test_patches_follow_their_places_and_repeat_the_edge() -> None:
    picture = np.random.default_rng(1).uniform(0, 9, (60, 90)).astype(np.float32)
    moved = np.roll(picture, (3, -2), axis=(0, 1))
    place = np.array([[45, 30]])
    one, other = (
        cut_patches(p, place + np.array(d), (9.0, 10.6), GRID)
        for p, d in ((picture, (0, 0)), (moved, (-2, 3)))
    )
    assert np.array_equal(one, other)
    corner = cut_patches(picture, np.array([[-500, -500]]), (9.0, 10.6), GRID)
    assert corner == pytest.approx(picture[0, 0], abs=1e-4)
