import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from contract.rig import Camera, Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.rig_json import camera_to_dict, rig_from_dict, rig_to_dict
from tests.paths import SAMPLES

DOCUMENT = json.loads((SAMPLES / "D1" / "rig.json").read_text())


def test_a_rig_is_the_rig_json() -> None:
    rig = rig_from_dict(DOCUMENT)
    assert Rig.of(rig).model_dump(mode="json") == rig_to_dict(rig) == DOCUMENT


@given(st.tuples(*[st.floats(-20, 20)] * 3))
def test_a_camera_passes_through_json_to_the_last_bit(shift: tuple[float, float, float]) -> None:
    was = DOCUMENT["left"]["position_mm"]
    position = [a + b for a, b in zip(was, shift, strict=True)]
    rig = rig_from_dict({**DOCUMENT, "left": {**DOCUMENT["left"], "position_mm": position}})
    document = json.loads(Rig.of(rig).model_dump_json())
    assert list(rig_from_dict(document).left.position_mm) == position
    assert document["left"] == camera_to_dict(rig.left)


def test_examples_are_rigs() -> None:
    (example,) = Rig.model_json_schema()["examples"]
    assert Rig.of(rig_from_dict(example)) == Rig.model_validate(example)


def test_a_camera_without_a_focal_length_is_none() -> None:
    with pytest.raises(ValidationError):
        Camera.model_validate({**DOCUMENT["left"], "focal_length_mm": 0.0})


@pytest.mark.parametrize("change", [{"name": 201 * "x"}, {"name": ""}])
def test_bounds_are_those_of_the_library(change: dict[str, str]) -> None:
    with pytest.raises(ValidationError):
        Rig.model_validate({**DOCUMENT, **change})
    with pytest.raises(RigError):
        rig_from_dict({**DOCUMENT, **change})
