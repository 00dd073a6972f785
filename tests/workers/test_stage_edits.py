from typing import Any

from contract.revision import LabelEdit, TriadEdits
from contract.stage import StageResult
from store.measurements import MeasuredStage
from tests.store.builders import stage_result, triad
from workers.stage_edits import edited, position_mm, removed_triads

VERTEBRAE = ("L1", "T11", "T9", "T7")
UNCERTAIN = {"code": "labels-uncertain", "detail": "which?"}
OTHER = {"code": "ball-occluded", "detail": "XX"}


def edit(result: StageResult, labels: dict[int, str | None], *removed: int) -> StageResult:
    listed = [LabelEdit(triad=k, label=label) for k, label in labels.items()]
    edits = TriadEdits(kind="edit", take=1, labels=listed, removed=list(removed))
    return edited(MeasuredStage(result), edits, VERTEBRAE, "L1").result


def unlabelled(number: int) -> dict[str, Any]:
    return {**triad("L1"), "label": None, "label_reason": f"not certain {number}"}


def test_labels_are_set_and_triads_are_in_their_order() -> None:
    result = stage_result([unlabelled(0), unlabelled(1), unlabelled(2)], flags=[UNCERTAIN, OTHER])
    after = edit(result, {0: "T9", 2: "L1"})
    assert [(t.label, t.label_reason) for t in after.triads] == [
        ("L1", None),
        ("T9", None),
        (None, "not certain 1"),
    ]
    assert [flag.code for flag in after.flags] == ["labels-uncertain", "ball-occluded"]
    whole = edit(result, {0: "T9", 2: "L1"}, 1)
    assert [t.label for t in whole.triads] == ["L1", "T9"]
    assert [flag.code for flag in whole.flags] == ["triad-count-low"]


def test_a_label_is_taken_away_with_a_reason() -> None:
    after = edit(stage_result(), {0: None})
    assert [t.label for t in after.triads] == ["T11", None]
    assert after.triads[1].label_reason == "the label was taken away by a person"


def test_everything_else_stays_as_it_was_measured() -> None:
    before = stage_result()
    after = edit(before, {0: "L1"})
    assert after.triads[0].label_manual
    triads = [before.triads[0].model_copy(update={"label_manual": True}), before.triads[1]]
    assert after == before.model_copy(update={"triads": triads})


def test_a_removed_triad_is_remembered_and_flags_follow() -> None:
    before = stage_result(flags=[{"code": "triad-count-high", "detail": "5"}, OTHER])
    after = edit(before, {}, 1)
    (gone,) = after.removed
    assert (gone.position_mm, gone.left) == ([1.0, 2.0, 3.0], [])
    assert [flag.code for flag in after.flags] == ["triad-count-low"]
    again = edit(after, {}, 0)
    assert len(again.removed) == 2


def test_a_triad_without_a_pose_is_where_its_balls_are() -> None:
    ball = {"sd_mm": [1.0, 1.0, 1.0], "left": [1.0, 2.0], "right": None, "parallax_mm": None}
    balls = {name: {**ball, "position_mm": [x, 0.0, 0.0]} for name, x in (("XX", 1.0), ("YY", 3.0))}
    fields = (
        "position_mm",
        "position_sd_mm",
        "normal",
        "angles_deg",
        "rotation",
        "rotation_sd_deg",
        "covariance",
    )
    result = stage_result([triad("L1", **dict.fromkeys(fields), balls=balls), triad("T11")])
    at = position_mm(result.triads[0])
    assert at is not None
    assert at.tolist() == [2.0, 0.0, 0.0]
    (gone,) = removed_triads(result, [0])
    assert (gone.left, gone.right) == ([[1.0, 2.0], [1.0, 2.0]], [])
