"""What an earlier stage says of labels."""

import numpy as np
import pytest

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.triads.known_configuration import KnownConfiguration, known_problem
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.labels import label_triads
from spinewatch.triads.pose import MeasuredTriad, Pose

P = LabelParameters()
LABELS = ("L1", "T11", "T9", "T7")
ALONG = (0.0, 52.0, 104.0, 151.0)
TURNS = ((0.3, 0.0, 1.0), (-0.2, 0.4, -2.0), (0.1, -0.3, 0.5), (0.0, 0.2, 2.5))


def stage(along: tuple[float, ...] = ALONG, turn: float = 0.0) -> list[MeasuredTriad]:
    """Triads in order; each is turned by ``turn`` radians more than the one before."""
    return [
        MeasuredTriad(
            "flat",
            {},
            Pose(
                np.array([x, 3.0 * k**2, 0.0]),
                rotation_from_vector(np.array([k * turn, 0, 0])) @ rotation_from_vector(np.array(TURNS[k])),
                1e-2 * np.eye(6),
            ),
            0.0,
        )
        for k, x in enumerate(along)
    ]


def earlier(labels: tuple[str, ...] = LABELS) -> KnownConfiguration:
    return KnownConfiguration({name: t.pose for name, t in zip(labels, stage(), strict=True) if t.pose})


def test_the_same_labels_in_the_same_order_are_no_problem_even_if_the_spine_was_straightened() -> None:
    moved = stage((0.0, 56.0, 112.0, 163.0), turn=0.2)
    assert known_problem((0, 1, 2, 3), moved, LABELS, P, earlier()) is None
    assert known_problem((0, 1, 2, 3), moved, LABELS, P, KnownConfiguration()) is None


def test_the_opposite_order_is_named_and_no_triad_is_labelled() -> None:
    reverse = LABELS[::-1]
    problem = known_problem((0, 1, 2, 3), stage(turn=0.05), reverse, P, earlier())
    assert problem is not None
    assert "opposite order, L1, T11, T9, T7" in problem
    labelled, flags = label_triads(stage(), reverse, "x", P, earlier())
    assert [triad.label for triad in labelled] == [None] * 4
    assert [flag.code for flag in flags] == ["levels-implausible"]


@pytest.mark.parametrize("names", [("L2", "T12", "T10", "T8"), ("T12", "T10", "T8", "T6")])
def test_other_vertebrae_than_those_of_the_earlier_stage_are_named(names: tuple[str, ...]) -> None:
    problem = known_problem((0, 1, 2, 3), stage(), names, P, earlier())
    assert problem == (
        f"the labels are {', '.join(names)}, and the earlier stage has L1, T11, T9, T7; give the names of the same"
        " vertebrae, or no earlier stage"
    )


def test_a_triad_more_or_less_is_no_problem() -> None:
    assert known_problem((0, 1, 2), stage()[:3], LABELS, P, earlier()) is None
    assert known_problem((0, 1, 2, 3), stage(), ("L3", *LABELS[1:]), P, earlier()) is None
