import copy
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import RigError
from spinewatch.rig_files.rig_json import decode_json, parse_rig, rig_from_dict, rig_to_dict
from spinewatch.simulation.rigs import table_3_3_rig

DOCUMENT = rig_to_dict(table_3_3_rig())
FIELDS = sorted(DOCUMENT["left"])


def altered(side: str, field: str, value: object) -> dict[str, Any]:
    document = copy.deepcopy(DOCUMENT)
    if value is None:
        del document[side][field]
    else:
        document[side][field] = value
    return document


def test_a_rig_survives_the_round_trip_exactly() -> None:
    assert rig_to_dict(parse_rig(json.dumps(DOCUMENT))) == DOCUMENT


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("field", FIELDS)
def test_a_missing_number_is_named(side: str, field: str) -> None:
    with pytest.raises(RigError, match="missing") as caught:
        rig_from_dict(altered(side, field, None))
    assert caught.value.field == f"{side}.{field}"


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("number", [float("nan"), float("inf"), 10**400, "5", True])
def test_an_entry_that_is_not_a_finite_number_is_named(field: str, number: object) -> None:
    was = DOCUMENT["left"][field]
    value = [number, *was[1:]] if isinstance(was, list) else number
    with pytest.raises(RigError) as caught:
        rig_from_dict(altered("left", field, value))
    assert caught.value.field == f"left.{field}"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("focal_length_mm", -7.0),
        ("focal_length_mm", 0),
        ("image_size_px", [568.5, 416]),
        ("image_size_px", [0, 416]),
        ("pixel_size_mm", [0.01, -0.01]),
        ("image_size_px", [568, 100_001]),
        ("position_mm", [1e10, 0, 0]),
        ("pixel_size_mm", [10.0, 8.45]),
        ("radial", [0.1]),
        ("skew", [0.0]),
    ],
)
def test_impossible_cameras_are_refused(field: str, value: object) -> None:
    with pytest.raises(RigError) as caught:
        rig_from_dict(altered("right", field, value))
    assert caught.value.field == f"right.{field}"


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ([], "(document)"),
        ({**DOCUMENT, "middle": {}}, "middle"),
        ({**DOCUMENT, "name": " "}, "name"),
        ({**DOCUMENT, "name": 5}, "name"),
        ({**DOCUMENT, "name": "cart\x001"}, "name"),
        ({**DOCUMENT, "name": "\ud800"}, "name"),
        ({**DOCUMENT, "name": 201 * "x"}, "name"),
        ({"name": "rig", "left": DOCUMENT["left"]}, "right"),
        ({**DOCUMENT, "left": []}, "left"),
    ],
)
def test_an_object_that_is_not_a_rig_is_refused(document: object, field: str) -> None:
    with pytest.raises(RigError) as caught:
        rig_from_dict(document)
    assert caught.value.field == field


def test_two_cameras_in_one_position_are_refused() -> None:
    with pytest.raises(RigError, match="baseline"):
        rig_from_dict(altered("right", "position_mm", DOCUMENT["left"]["position_mm"]))


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_text_and_bytes_may_start_with_a_byte_order_mark(mark: str) -> None:
    text = mark + json.dumps(DOCUMENT)
    assert rig_to_dict(parse_rig(text)) == rig_to_dict(parse_rig(text.encode())) == DOCUMENT


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        (
            '"focal_length_mm": 7.776',
            '"focal_length_mm": 7.776, "focal_length_mm": 77.76',
            "left.focal_length_mm",
        ),
        (
            '"focal_length_mm": 7.556',
            '"focal_length_mm": 7.556, "focal_length_mm": 7.556',
            "right.focal_length_mm",
        ),
        ('"right"', '"left"', "left"),
        ('{"name"', '{"name": "a", "name"', "name"),
    ],
)
def test_a_field_given_twice_is_named_with_its_path(old: str, new: str, field: str) -> None:
    text = json.dumps(DOCUMENT)
    assert old in text
    with pytest.raises(RigError, match="is given twice") as caught:
        parse_rig(text.replace(old, new))
    assert caught.value.field == field


def test_a_field_given_twice_is_found_in_lists() -> None:
    with pytest.raises(RigError) as caught:
        decode_json('[{}, {"a": {"b": 1, "b": 2}}]')
    assert caught.value.field == "1.a.b"


@given(st.text())
def test_any_text_gives_a_rig_or_a_named_error(text: str) -> None:
    with pytest.raises(RigError):
        parse_rig(text)


def test_deep_nesting_is_refused() -> None:
    with pytest.raises(RigError):
        parse_rig("[" * 100_000)
