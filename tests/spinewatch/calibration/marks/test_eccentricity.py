import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.marks.eccentricity import eccentricity_px
from spinewatch.simulation.rigs import random_rig
from tests.spinewatch.calibration.simulated import FIELD, IDENTITY, TABLE_3_3, TYPICAL, moved_board

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.floats(2.0, 8.0))
@settings(max_examples=20, deadline=None)
def test_the_offset_is_that_of_a_densely_sampled_disc(seed: int, radius_mm: float) -> None:
    camera, placement = random_rig(np.random.default_rng(seed)).left, moved_board(seed)
    control = np.array([[420.0, 380.0, 40.0]])
    centre = placement(control)
    # Uniform samples of the disc, weighted by how much image area each covers.
    r, angle = np.meshgrid(
        radius_mm * np.sqrt((np.arange(60) + 0.5) / 60), 2 * np.pi * np.arange(90) / 90, indexing="ij"
    )
    samples = control + np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros_like(r)], -1).reshape(-1, 3)
    J = camera.projection_jacobian(placement(samples)) @ placement.rotation[:, :2]
    weight = np.abs(np.linalg.det(J))
    pixels = camera.project(placement(samples))
    centroid = (weight[:, None] * pixels).sum(axis=0) / weight.sum()
    scale = np.abs(np.linalg.det(camera.projection_jacobian(centre) @ placement.rotation[:, :2]))
    found = eccentricity_px(camera, placement, control, radius_mm**2 / 4 * scale)[0]
    true = centroid - camera.project(centre)[0]
    assert np.abs(found - true).max() < 2e-4 + 0.02 * np.abs(true).max()


def test_the_offset_grows_with_the_area_of_the_mark() -> None:
    control = FIELD.take(TYPICAL)
    small, large = (
        eccentricity_px(TABLE_3_3.left, IDENTITY, control, np.full(12, variance)) for variance in (5.0, 10.0)
    )
    assert np.allclose(large, 2 * small, rtol=0.02, atol=1e-5)
    assert np.linalg.norm(large, axis=1).min() > 0
