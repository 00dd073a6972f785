from typing import Any

from spinewatch.stage import StageRequest
from store.measurements import MeasuredStage
from store.stage_work import LabelledStage
from tests.store.builders import stage_result, triad
from workers.stage_manual_labels import check_manual_labels

REQUEST = StageRequest(labels=("L1", "T11", "T9", "T7"), spine_axis="x")
FLAGS = [{"code": "levels-implausible", "detail": "found"}, {"code": "ball-occluded", "detail": "XX"}]
NO_POSE = (
    "position_mm",
    "position_sd_mm",
    "normal",
    "angles_deg",
    "rotation",
    "rotation_sd_deg",
    "covariance",
)


def at(x: float, label: str | None, *, manual: bool = True) -> dict[str, Any]:
    return triad(label, position_mm=[x, 0.0, 0.0], label_manual=manual)


def flags_of(*triads: dict[str, Any], earlier: LabelledStage | None = None) -> list[str]:
    before = stage_result(list(triads), flags=FLAGS)
    after = check_manual_labels(MeasuredStage(before), REQUEST, earlier).result
    assert after.triads == before.triads
    return [flag.code for flag in after.flags]


def test_exchanged_labels_of_a_person_are_flagged_and_stay() -> None:
    exchanged = flags_of(at(349, "L1"), at(454, "T11"), at(398, "T9"), at(500, "T7"))
    assert exchanged == ["ball-occluded", "levels-implausible"]


def test_plausible_labels_of_a_person_take_the_flag_away() -> None:
    assert flags_of(at(349, "L1"), at(398, "T11"), at(454, "T9"), at(500, "T7")) == ["ball-occluded"]


def test_without_a_label_of_a_person_flags_stay() -> None:
    assert flags_of(at(349, None), at(398, None)) == ["levels-implausible", "ball-occluded"]
    assert flags_of(at(349, "T11", manual=False), at(398, "L1", manual=False)) == [
        "levels-implausible",
        "ball-occluded",
    ]


def test_distances_of_an_earlier_stage_are_plausible() -> None:
    x = {"L1": 0.0, "T11": 20.0, "T9": 75.0, "T7": 130.0}
    triads = [at(place, label) for label, place in x.items()]
    assert flags_of(*triads) == ["ball-occluded", "levels-implausible"]
    poses = {each.label: each.pose() for each in stage_result(triads).triads}
    known = {label: pose for label, pose in poses.items() if label is not None and pose is not None}
    assert flags_of(*triads, earlier=LabelledStage("PRE", 1, known)) == ["ball-occluded"]


def test_a_triad_without_a_place_does_not_count() -> None:
    nowhere = triad("T9", label_manual=True, **dict.fromkeys(NO_POSE))
    assert flags_of(at(349, "L1"), at(398, "T11"), nowhere) == ["ball-occluded"]
