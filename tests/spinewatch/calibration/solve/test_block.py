import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.solve.block import Block, moved_placements
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_vector
from tests.spinewatch.calibration.simulated import IDENTITY, TABLE_3_3, TYPICAL, image, moved_board

seeds = st.integers(0, 2**32 - 1)
PLACEMENTS = (IDENTITY, moved_board(1), moved_board(2))


def block() -> Block:
    images = {
        (c, s): image(camera, TYPICAL[: 4 + c + s], placement)
        for c, camera in enumerate((TABLE_3_3.left, TABLE_3_3.right))
        for s, placement in enumerate(PLACEMENTS)
        if (c, s) != (1, 1)
    }
    return Block((TABLE_3_3.left, TABLE_3_3.right), PLACEMENTS, images, (("f", "K1"), ("X0", "x0", "aspect")))


def test_observations_and_unknowns_are_counted_and_named() -> None:
    b = block()
    assert b.n_observations == 2 * (4 + 5 + 6 + 5 + 7)
    assert b.n_unknowns == len(b.unknown_names) == 5 + 12
    assert b.dof == b.n_observations - 17
    assert b.unknown_names[:6] == ("0:f", "0:K1", "1:X0", "1:x0", "1:aspect", "placement 1:rx")


def test_slices_cover_all_observations_in_the_order_of_cameras_and_shots() -> None:
    slices = block().observation_slices
    assert list(slices) == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 2)]
    covered = np.concatenate([np.arange(s.start, s.stop) for s in slices.values()])
    assert np.array_equal(covered, np.arange(block().n_observations))


@given(seeds)
def test_a_change_is_added_to_the_free_parameters_alone(seed: int) -> None:
    b = block()
    change = np.random.default_rng(seed).normal(0, 1e-3, b.n_unknowns)
    changed = b.changed(change)
    for before, after, free, part in zip(
        b.cameras, changed.cameras, b.free, (change[:2], change[2:5]), strict=True
    ):
        difference = camera_vector(after) - camera_vector(before)
        expected = dict(zip(free, part, strict=True))
        assert np.allclose(difference, [expected.get(n, 0.0) for n in PARAMETER_NAMES], atol=1e-12)
    assert changed.placements[0] is b.placements[0]


@given(seeds)
def test_a_placement_is_rotated_about_its_own_origin(seed: int) -> None:
    motions = np.random.default_rng(seed).normal(0, 0.1, 12)
    moved = moved_placements(PLACEMENTS, motions)
    for before, after, motion in zip(PLACEMENTS[1:], moved[1:], motions.reshape(2, 6), strict=True):
        assert np.allclose(after.translation_mm - before.translation_mm, motion[3:])
        R = after.rotation @ before.rotation.T
        angle = np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))
        assert np.isclose(angle, np.linalg.norm(motion[:3]), atol=1e-7)
