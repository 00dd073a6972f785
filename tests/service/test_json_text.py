import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contract.stage_reference import StageReference
from service import json_text

DOCUMENT = StageReference(name="PRE", take=1, calibration_id="c")
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.text(),
    lambda inner: st.lists(inner, max_size=3),
)


@given(JSON)
def test_members_are_replaced_by_the_text_as_it_is(value: object) -> None:
    parts = json_text.with_members(DOCUMENT, {"take": [json.dumps(value)]})
    assert json.loads("".join(parts)) == {"name": "PRE", "calibration_id": "c", "take": value}


def test_all_members_can_be_replaced() -> None:
    members = {name: ["nu", "ll"] for name in StageReference.model_fields}
    assert json.loads("".join(json_text.with_members(DOCUMENT, members))) == dict.fromkeys(members)


@pytest.mark.parametrize("items", [[], ["1"], ['{"a": 1}', "[]", '"x"']])
def test_arrays(items: list[str]) -> None:
    assert json.loads("".join(json_text.array([item] for item in items))) == [
        json.loads(item) for item in items
    ]
