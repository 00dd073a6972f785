from exports.open_ends import beyond, open_ends
from tests.contract.spine_results import stage_spine


def test_only_curves_with_an_open_end_are_named() -> None:
    spine = stage_spine(1)
    closed = spine.curves[0].model_copy(update={"name": "curve 2", "open_ends": []})
    both = spine.curves[0].model_copy(update={"name": "curve 3", "open_ends": ["T7", "L1"]})
    found = open_ends(spine.model_copy(update={"curves": [spine.curves[0], closed, both]}))
    assert found == {"curve 1": ("L1",), "curve 3": ("T7", "L1")}


def test_two_ends_are_named_together() -> None:
    assert beyond(["T7", "L1"]) == (
        "the curve may go on beyond T7 and L1, which are the ends of the measured span"
    )
