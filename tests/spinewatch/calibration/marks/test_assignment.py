from dataclasses import replace

import numpy as np
import pytest

from spinewatch.calibration.marks.assignment import (
    Assignment,
    IdentificationTask,
    MarkIdentificationParameters,
    assign_with_lens,
    match_points,
    refine_assignment,
)
from spinewatch.camera import Camera
from tests.spinewatch.calibration.simulated import FIELD, TABLE_3_3, TYPICAL, WIDE

PARAMETERS = MarkIdentificationParameters()
INDICES = [FIELD.ids.index(id_) for id_ in TYPICAL]


def task(camera: Camera = TABLE_3_3.left, sigma_px: float = 0.03) -> IdentificationTask:
    noise = sigma_px * np.random.default_rng(0).standard_normal((12, 2))
    return IdentificationTask(camera.project(FIELD.take(TYPICAL)) + noise, FIELD, 568, PARAMETERS)


def near(camera: Camera) -> Camera:
    """The camera with a wrong lens, rotated by half a degree."""
    x, y, z = camera.rotation_deg
    return replace(
        camera, rotation_deg=(x + 0.5, y - 0.5, z), radial=(0.0, 0.0), principal_point_mm=(0.0, 0.0)
    )


def test_matches_are_one_to_one_and_within_the_tolerance() -> None:
    X, camera = FIELD.points_mm, TABLE_3_3.left
    pixels = np.concatenate([camera.project(X[[8, 3]]) + 0.4, camera.project(X[[8]]) + 0.9, [[5.0, 5.0]]])
    target, control = match_points(camera, pixels, X, 2.0)
    assert dict(zip(target.tolist(), control.tolist(), strict=True)) == {0: 8, 1: 3}


def test_an_approximate_camera_grows_to_the_true_assignment() -> None:
    found = refine_assignment(near(TABLE_3_3.left), task())
    assert found is not None
    assert found.control[np.argsort(found.target)].tolist() == INDICES
    assert found.sigma_px < 0.1


def test_a_camera_elsewhere_gives_no_assignment() -> None:
    assert refine_assignment(WIDE.right, task()) is None


def test_a_known_lens_needs_only_the_pose_and_enough_matches() -> None:
    found = assign_with_lens(near(TABLE_3_3.left), TABLE_3_3.left, 10, task())
    assert found is not None
    assert len(found) == 12
    assert assign_with_lens(near(TABLE_3_3.left), TABLE_3_3.left, 13, task()) is None


@pytest.mark.parametrize(
    ("n", "sigma_px", "significant"),
    [(12, 0.2, True), (12, 0.5, True), (12, 1.0, False), (11, 0.2, True), (8, 0.2, False), (8, 0.5, False)],
)
def test_an_assignment_is_significant_when_few_could_fit_by_chance(
    n: int, sigma_px: float, significant: bool
) -> None:
    assignment = Assignment(np.arange(n), np.arange(n), sigma_px, TABLE_3_3.left)
    assert task().is_significant(assignment) is significant


def test_common_pairs_are_counted() -> None:
    a = Assignment(np.array([0, 1, 2]), np.array([5, 6, 7]), 0.1, TABLE_3_3.left)
    b = Assignment(np.array([2, 0, 1]), np.array([7, 5, 8]), 0.1, TABLE_3_3.left)
    assert a.n_common(b) == b.n_common(a) == 2
