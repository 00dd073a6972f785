"""The pose's fields: one spelling in the contract, one in the library."""

import re

import numpy as np
import pytest

from contract.pose import FrameTransform, PoseFields, pose_fields, pose_model
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.triads.pose import Pose
from tests.contract.results import pose
from tests.paths import PROJECT

ROOMS = (
    "contract",
    "spinewatch",
    "store",
    "workers",
    "service",
    "exports",
    "reports",
    "commands",
    "settings",
)
NAMES = ("position_sd_mm", "angles_deg", "rotation_sd_deg", "covariance", "normal")


def test_the_fields_of_a_pose_are_spelled_once_in_the_contract_and_once_in_the_library() -> None:
    spelled = {
        path.relative_to(PROJECT).as_posix()
        for room in ROOMS
        for path in (PROJECT / room).rglob("*.py")
        if all(re.search(rf"\b{name}\b", path.read_text()) for name in NAMES)
    }
    assert spelled == {"contract/pose.py", "spinewatch/triads/pose.py"}


@pytest.mark.parametrize("seed", range(5))
def test_a_pose_passes_through_json_to_the_last_bit(seed: int) -> None:
    given = pose(seed)
    made = pose_model(given)
    again = PoseFields.model_validate_json(made.model_dump_json()).pose()
    assert isinstance(again, Pose)
    for name in ("position_mm", "rotation", "covariance"):
        assert getattr(again, name).tobytes() == np.ascontiguousarray(getattr(given, name)).tobytes()


def test_derived_fields_agree_with_the_pose() -> None:
    given = pose()
    made = pose_model(given)
    assert made.normal == given.rotation[:, 2].tolist()
    np.testing.assert_allclose(np.cos(np.radians(made.angles_deg or [])), given.normal)
    np.testing.assert_allclose(np.square(made.position_sd_mm or []), np.diag(given.covariance)[:3])


def test_without_a_pose_every_field_is_null() -> None:
    made = PoseFields(**pose_fields(None, "two balls only"))
    assert made.pose() is None
    assert made.model_dump(exclude_none=True) == {"reason": "two balls only"}


def test_a_transform_of_the_library_passes_through_json_to_the_last_bit() -> None:
    given = RigidTransform(pose(3).rotation, np.array([0.1, -2.0, 300.7]))
    made = FrameTransform.model_validate(given)
    again = FrameTransform.model_validate_json(made.model_dump_json())
    assert np.array(again.rotation).tobytes() == np.ascontiguousarray(given.rotation).tobytes()
    assert again.translation_mm == given.translation_mm.tolist()
