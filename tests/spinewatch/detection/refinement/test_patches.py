"""Patches: whatever the camera's pixels, the same ball gives the same patch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.refinement.patches import PatchGrid, cut_patches, resampling

GRID = PatchGrid(25, 5.0)


@given(st.floats(2, 60))
def test_an_even_image_stays_even_and_a_ramp_a_ramp(radius_px: float) -> None:
    matrix = resampling(radius_px, GRID)
    pixels = np.arange(matrix.shape[1]) - matrix.shape[1] // 2
    assert matrix.sum(axis=1) == pytest.approx(1, abs=1e-5)
    wanted = (np.arange(GRID.size) - GRID.size // 2) * radius_px / GRID.radius
    assert matrix @ pixels == pytest.approx(wanted, abs=0.03 * max(radius_px / GRID.radius, 1))


@settings(max_examples=25, deadline=None)
@given(st.floats(6, 30), st.floats(6, 30))
def test_balls_of_any_size_and_aspect_give_equal_patches(width: float, height: float) -> None:
    def patch(w: float, h: float) -> NDArray[np.float32]:
        y, x = np.mgrid[-80:81, -80:81]
        # A shape that both pixels and samples resolve.
        image = np.exp(-0.5 * ((x / w * 2) ** 2 + (y / h * 2) ** 2)).astype(np.float32)
        return np.asarray(cut_patches(image, np.array([[80, 80]]), (w, h), GRID)[0])

    assert patch(width, height) == pytest.approx(patch(10, 10), abs=0.06)


def test_patches_move_with_the_image_and_repeat_the_edge() -> None:
    image = np.random.default_rng(1).uniform(0, 9, (60, 90)).astype(np.float32)
    moved = np.roll(image, (3, -2), axis=(0, 1))
    centre = np.array([[45, 30]])
    one, other = (
        cut_patches(p, centre + np.array(d), (9.0, 10.6), GRID)
        for p, d in ((image, (0, 0)), (moved, (-2, 3)))
    )
    assert np.array_equal(one, other)
    corner = cut_patches(image, np.array([[-500, -500]]), (9.0, 10.6), GRID)
    assert corner == pytest.approx(image[0, 0], abs=1e-4)
