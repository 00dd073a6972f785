from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.levels import LevelError
from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.labels import label_triads
from spinewatch.triads.pose import DOUBTFUL, Ball, MeasuredTriad, Pose

LABELS = ("L1", "T11", "T9", "T7")


def chain(*along: float, axis: Any = "x") -> list[MeasuredTriad]:
    positions = np.zeros((len(along), 3))
    positions[:, "xy".index(axis)] = along
    return [MeasuredTriad("flat", {}, Pose(p, np.eye(3), np.zeros((6, 6))), 0.0) for p in positions]


def labels_of(
    triads: Any, labels: Sequence[str] = LABELS, axis: Any = "auto", parameters: LabelParameters | None = None
) -> tuple[list[str | None], list[str | None], list[str]]:
    labelled, flags = label_triads(triads, labels, axis, parameters)
    return [t.label for t in labelled], [t.label_reason for t in labelled], [f.code for f in flags]


@pytest.mark.parametrize("axis", ["x", "y", "auto"])
def test_a_complete_chain_is_labelled_by_order(axis: Any) -> None:
    along = "y" if axis == "auto" else axis
    triads = chain(150, 0, 100, 55, axis=along)
    labelled, flags = label_triads(triads, LABELS, axis)
    assert [t.label for t in labelled] == list(LABELS)
    assert [t.triad for t in labelled] == [triads[1], triads[3], triads[2], triads[0]]
    assert flags == ()


@pytest.mark.parametrize(
    ("along", "expected"),
    [((0, 98, 151), ["L1", "T9", "T7"]), ((0, 52, 150), ["L1", "T11", "T7"])],
)
def test_a_wide_gap_shows_which_is_missing(along: Any, expected: Any) -> None:
    assert labels_of(chain(*along)) == (expected, [None] * 3, [])


def test_a_triad_missing_at_an_end_gives_no_labels() -> None:
    labels, reasons, flags = labels_of(chain(0, 51, 99))
    assert labels == [None] * 3
    assert all("missing" in str(reason) for reason in reasons)
    assert flags == ["labels-uncertain"]


def test_gaps_that_could_be_either_give_no_labels() -> None:
    assert labels_of(chain(0, 50, 120))[0] == [None] * 3


def test_two_missing_inside_a_chain_of_six() -> None:
    labels = ("L3", "L1", "T11", "T9", "T7", "T5")
    assert labels_of(chain(0, 51, 199, 250), labels)[0] == ["L3", "L1", "T7", "T5"]


@pytest.mark.parametrize("along", [(10,), (10, 60)])
def test_too_few_triads_give_no_labels(along: Any) -> None:
    labels, reasons, _ = labels_of(chain(*along))
    assert set(labels) == {None}
    assert all(reasons)


def test_more_triads_than_labels_are_not_guessed() -> None:
    labels, reasons, flags = labels_of(chain(0, 50, 100, 150, 200))
    assert set(labels) == {None}
    assert "5 triads" in str(reasons[0])
    assert flags == ["labels-uncertain"]


def test_without_labels_there_is_nothing_to_flag() -> None:
    assert labels_of(chain(50, 0), ()) == ([None, None], ["no labels were given"] * 2, [])
    assert label_triads([], LABELS) == ((), ())


def test_uneven_levels_count_in_vertebrae() -> None:
    # T11 and T10 are one vertebra apart: 26 mm is no gap, and 75 mm is.
    assert labels_of(chain(0, 51, 150), ("L1", "T11", "T10", "T7"))[0] == ["L1", "T11", "T7"]


def test_the_needed_certainty_is_a_parameter() -> None:
    triads = chain(0, 75, 125)
    assert labels_of(triads)[0] == [None] * 3
    assert labels_of(triads, parameters=LabelParameters(min_likelihood_ratio=1.0))[0] == ["L1", "T9", "T7"]


def earlier(**along: float) -> KnownConfiguration:
    return KnownConfiguration(
        poses={name: Pose(np.array([x, 0.0, 0.0]), np.eye(3), np.zeros((6, 6))) for name, x in along.items()}
    )


def named(triads: Any, known: KnownConfiguration, labels: Sequence[str] = LABELS) -> list[str | None]:
    return [t.label for t in label_triads(triads, labels, known=known)[0]]


def test_an_earlier_stage_shows_even_which_end_is_missing() -> None:
    before = earlier(L1=0, T11=42, T9=100, T7=148)
    assert named(chain(10, 69, 117), before) == ["T11", "T9", "T7"]
    assert named(chain(10, 53, 110), before) == ["L1", "T11", "T9"]
    assert named(chain(10, 52), before) == [None, None]  # 42 mm might be T9 and T7, which were 48 mm apart


def test_distances_of_radiographs_do_the_same() -> None:
    distances = {("L1", "T11"): 42.0, ("T9", "T11"): 58.0, ("L1", "T9"): 100.0}
    known = KnownConfiguration(distances_mm=distances)
    assert named(chain(0, 59), known, LABELS[:3]) == ["T11", "T9"]
    assert named(chain(0, 59), KnownConfiguration(), LABELS[:3]) == [None, None]


def test_rotations_between_neighbours_decide_where_distances_do_not() -> None:
    angles = (0.0, 0.5, 1.7, -0.4)
    poses = [
        Pose(np.array([50.0 * i, 0, 0]), rotation_from_vector(np.array([0, 0, angle])), np.zeros((6, 6)))
        for i, angle in enumerate(angles)
    ]
    known = KnownConfiguration(poses=dict(zip(LABELS, poses, strict=True)))
    found = [MeasuredTriad("flat", {}, pose, 0.0) for pose in poses[1:]]
    assert named(found, known) == ["T11", "T9", "T7"]


def test_a_configuration_that_does_not_fit_gives_no_labels() -> None:
    labelled, flags = label_triads(chain(0, 20, 200), LABELS, known=earlier(L1=0, T11=50, T9=100, T7=150))
    assert {t.label for t in labelled} == {None}
    assert "do not fit" in flags[0].detail


@pytest.mark.parametrize(("turned", "labels"), [(1, ["T11", "T9", "T7"]), (2, [None] * 3)])
def test_one_marker_may_be_clamped_again_but_not_all(turned: int, labels: list[str | None]) -> None:
    before = earlier(L1=0, T11=42, T9=100, T7=148)
    found = [
        MeasuredTriad(
            "flat",
            {},
            Pose(np.array([x, 0.0, 0.0]), rotation_from_vector(np.array([0, 0, angle])), np.zeros((6, 6))),
            0.0,
        )
        for x, angle in zip((10.0, 69.0, 117.0), (0.0, 0.8, 1.6 if turned == 2 else 0.9), strict=True)
    ]
    assert named(found, before) == labels


def test_markers_of_different_kinds_make_labels_certain() -> None:
    kinds = ("small", "large", "body", "small")
    known = KnownConfiguration(markers=dict(zip(LABELS, kinds, strict=True)))
    triads = [
        MeasuredTriad(kind, {}, t.pose, 0.0) for kind, t in zip(("large", "small"), chain(0, 77), strict=True)
    ]
    assert named(triads, known) == ["T11", "T7"]
    assert named([MeasuredTriad("body", {}, triads[0].pose, 0.0)], known) == ["T9"]
    assert named(triads[::-1], KnownConfiguration(markers={"L1": "body"}), LABELS[:2]) == [None, None]


def test_a_triad_without_a_pose_counts_in_the_order() -> None:
    ball = Ball(np.array([52.0, 3, 0]), np.eye(3), np.zeros(2), np.zeros(2), 0.1)
    triads = [*chain(0, 100, 150), MeasuredTriad("flat", {"XX": ball}, None, 0.0, "hidden")]
    labelled, _ = label_triads(triads, LABELS)
    assert [t.label for t in labelled] == list(LABELS)
    assert labelled[1].triad.pose is None


def doubtful(x: float, chance: float) -> MeasuredTriad:
    ball = Ball(np.array([x, 3, 0]), np.eye(3), np.zeros(2), np.zeros(2), 0.1)
    reason = f"{DOUBTFUL}: {chance:.0%}"
    return MeasuredTriad("flat", {"XX": ball}, None, 0.0, reason, chance_false=chance, doubtful=True)


def test_a_doubtful_triad_has_no_label() -> None:
    labelled, flags = label_triads([*chain(0, 98, 151), doubtful(52, 0.3)], LABELS)
    assert [t.label for t in labelled] == ["L1", None, "T9", "T7"]
    assert (labelled[1].label_reason, flags) == (DOUBTFUL, ())


def test_a_doubtful_triad_keeps_its_place_if_the_others_do_not_suffice() -> None:
    labelled, flags = label_triads([*chain(0, 52, 98), doubtful(150, 0.3)], LABELS)
    assert [t.label for t in labelled] == ["L1", "T11", "T9", None]
    assert flags == ()


def test_a_triad_that_is_more_likely_false_has_no_place() -> None:
    labelled, flags = label_triads([*chain(0, 52, 98), doubtful(150, 0.6)], LABELS)
    assert [t.label for t in labelled] == [None] * 4
    assert [flag.code for flag in flags] == ["labels-uncertain"]


def test_a_marker_that_was_clamped_again_does_not_prevent_labels() -> None:
    before = earlier(L1=0, T11=42, T9=100, T7=148)
    triads = chain(10, 69, 117)
    clamped = rotation_from_vector(np.array([0, 0, 1.5]))
    pose = triads[1].pose
    assert pose is not None
    triads[1] = MeasuredTriad("flat", {}, Pose(pose.position_mm, clamped, pose.covariance), 0.0)
    assert named(triads, before) == ["T11", "T9", "T7"]
    strict = LabelParameters(max_rotation_sigma=1000.0)
    labelled, _ = label_triads(triads, LABELS, parameters=strict, known=before)
    assert {t.label for t in labelled} == {None}


def test_the_number_of_assignments_is_limited() -> None:
    few = LabelParameters(max_assignments=3)
    assert labels_of(chain(0, 98, 151), parameters=few)[0] == [None] * 3
    assert labels_of(chain(0, 98, 151), parameters=LabelParameters(max_assignments=4))[0] == [
        "L1",
        "T9",
        "T7",
    ]


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (("L1", "T12", "T11", "T10"), "L1 and T12 are 50 mm apart, 50.0 mm per level instead of 12 to 45"),
        (("L1", "T11", "T10", "T7"), "57.0 mm per level"),
        (("L4", "T11", "T9", "T7"), "10.0 mm per level"),
        (("L2", "T11", "T9", "T7"), "fit L1,T11,T9,T7 "),
    ],
)
def test_labels_that_the_distances_contradict_are_null(labels: Any, words: str) -> None:
    labelled, flags = label_triads(chain(0, 50, 107, 155), labels)
    (flag,) = flags
    assert flag.code == "levels-implausible"
    assert words in flag.detail
    assert [(t.label, t.label_reason) for t in labelled] == [(None, flag.detail)] * 4


def test_known_distances_of_fused_vertebrae_decide() -> None:
    labels = ("L1", "T11", "T9", "T7")
    short = chain(0, 22, 72, 122)
    assert [flag.code for flag in label_triads(short, labels)[1]] == ["levels-implausible"]
    assert named(short, earlier(L1=0, T11=21, T9=70, T7=121), labels) == list(labels)
    assert named(short, earlier(L1=0, T11=50, T9=100, T7=150), labels) == [None] * 4


def test_a_triad_without_a_pose_gives_no_distance() -> None:
    ball = Ball(np.array([10.0, 3, 0]), np.eye(3), np.zeros(2), np.zeros(2), 0.1)
    triads = [*chain(0, 50, 100), MeasuredTriad("flat", {"XX": ball}, None, 0.0, "hidden")]
    labels = ("L1", "T12", "T11", "T9")
    assert [t.label for t in label_triads(triads, labels)[0]] == [*labels]
    assert [t.label for t in label_triads([triads[0], triads[3]], labels[:2])[0]] == [*labels[:2]]


def test_names_are_checked_and_spelled_canonically() -> None:
    assert labels_of(chain(0, 50, 100), ("l1", "T11", "T09"))[0] == ["L1", "T11", "T9"]
    with pytest.raises(LevelError, match="order"):
        labels_of(chain(0, 50, 100), ("L1", "T9", "T11"))
    labelled, flags = label_triads(chain(0, 52), ("L1", "T12"), extra_levels=("T13",))
    assert ([t.label for t in labelled], flags) == (["L1", "T12"], ())


@pytest.mark.parametrize(("axis", "other"), [("x", "y"), ("y", "x")])
def test_triads_that_do_not_lie_along_the_given_axis_are_not_labelled(axis: Any, other: Any) -> None:
    labelled, flags = label_triads(chain(0, 50, 100, 150, axis=other), LABELS, axis)
    assert [flag.code for flag in flags] == ["spine-axis-implausible"]
    assert f"90 degrees to the spine axis {axis}" in flags[0].detail
    assert {t.label for t in labelled} == {None}
    assert label_triads(chain(0, axis=other), LABELS[:1], axis)[1] == ()


def oblique(degrees: float) -> list[MeasuredTriad]:
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    return [
        MeasuredTriad("flat", {}, Pose(s * along, np.eye(3), np.zeros((6, 6))), 0.0)
        for s in (0, 50, 100, 150)
    ]


def test_an_oblique_spine_is_ordered_along_the_given_axis() -> None:
    assert labels_of(oblique(55), axis="x")[0] == list(LABELS)
    assert labels_of(oblique(-44), axis="x")[0] == list(LABELS)
    assert labels_of(oblique(-38))[0] == list(LABELS)


def test_between_the_axes_the_order_is_determined_only_if_both_give_the_same() -> None:
    assert labels_of(oblique(44))[0] == list(LABELS)
    labels, reasons, flags = labels_of(oblique(-44))
    assert (labels, flags) == ([None] * 4, ["spine-axis-implausible"])
    assert "44 degrees to the x axis" in str(reasons[0])
