"""Simulated radiographs against projections by brute force."""

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.radiographs import FilmParameters, digitized, radiograph_scene, shown_vertebra
from spinewatch.spine.radiograph_landmarks import RadiographView

FILMS = FilmParameters()
ROTATION = rotation_from_vector(np.array([0.3, -0.4, 0.5]))
OBJECT = RigidTransform(rotation_from_vector(np.array([1.0, 0.2, -0.3])), np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(("side", "u"), [("left", 90.0), ("right", 110.0)])
def test_a_point_on_the_patients_left_is_shown_on_the_stated_side(side: str, u: float) -> None:
    view = RadiographView((0.5, 0.2), "left" if side == "left" else "right")
    films = FilmParameters(pa=view, pa_centre_px=(100.0, 50.0))
    np.testing.assert_allclose(films.pa_px(np.array([7.0, 2.0, 5.0])), [u, 40.0])


def test_the_ends_of_an_end_plate_are_those_of_its_longest_shown_diameter() -> None:
    angle = np.linspace(0, 2 * np.pi, 3600, endpoint=False)
    rim = 20 * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1) @ ROTATION.T
    found = shown_vertebra(
        "T9", -12.5 * ROTATION[:, 2], ROTATION, 0.7
    )  # the upper end plate is at the origin
    for view, points, axes in ((FILMS.pa, found.pa_px, [1, 2]), (FILMS.lateral, found.lateral_px, [0, 2])):
        shown = rim[:, axes]
        end = shown[np.linalg.norm(shown, axis=1).argmax()]
        stated = np.subtract(*view.to_plane(points[:2])) / 2
        np.testing.assert_allclose(stated, end * np.sign(end[0]), atol=0.2)
        assert np.linalg.norm(stated) == pytest.approx(20, abs=1e-9)


def test_pedicles_lie_behind_the_body_at_the_ratio() -> None:
    found = shown_vertebra("T9", np.zeros(3), np.eye(3), 0.5)
    assert found.pedicles_px is not None
    np.testing.assert_allclose(found.pedicles_px[:, 1], FILMS.pa_centre_px[1])
    width = np.subtract(*found.pedicles_px)[0] * FILMS.pa.pixel_spacing_mm[1]
    assert width == pytest.approx(-25)  # the patient's left is on the left
    quarter = rotation_from_vector(np.array([0, 0, np.pi / 2]))
    side = shown_vertebra("T9", np.zeros(3), quarter, 0.5).pedicles_px
    assert side is not None
    across = (side[:, 0] - FILMS.pa_centre_px[0]) * -FILMS.pa.pixel_spacing_mm[1]
    np.testing.assert_allclose(across, -25)  # D = W / (2 x 0.5) behind, which is now to the right


def positions() -> tuple[Float, Float]:
    return np.array([[0.0, 0, 30], [0, 5, 0], [0, 0, -30]]), np.tile(np.eye(3), (3, 1, 1))


def test_a_scene_has_the_truth_in_object_space() -> None:
    place, axes = positions()
    scene = radiograph_scene(("T8", "T9", "T10"), place, axes, OBJECT, np.random.default_rng(0))
    np.testing.assert_allclose(scene.position_mm, OBJECT(place))
    np.testing.assert_allclose(scene.rotation, OBJECT.rotation @ axes)
    assert [vertebra.level for vertebra in scene.vertebrae] == ["T8", "T9", "T10"]
    assert len(scene.common) == 8
    np.testing.assert_array_equal(scene.common[0].covariance_mm2, 0.09 * np.eye(3))


def test_digitizing_moves_every_landmark_by_the_stated_deviation() -> None:
    place, axes = positions()
    scene = radiograph_scene(("T8", "T9", "T10"), place, axes, OBJECT, np.random.default_rng(0))
    moves: list[Float] = []
    for seed in range(100):
        seen = digitized(scene, 2.0, np.random.default_rng(seed))
        for before, after in zip(scene.vertebrae, seen.vertebrae, strict=True):
            assert before.pedicles_px is not None
            assert after.pedicles_px is not None
            moves += [
                after.pa_px - before.pa_px,
                after.lateral_px - before.lateral_px,
                after.pedicles_px - before.pedicles_px,
            ]
        moves += [
            np.stack([a.pa_px - b.pa_px, a.lateral_px - b.lateral_px])
            for a, b in zip(seen.common, scene.common, strict=True)
        ]
    assert np.concatenate(moves).std() == pytest.approx(2.0, rel=0.03)
