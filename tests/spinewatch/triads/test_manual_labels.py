from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.manual_labels import manual_label_flags
from spinewatch.triads.pose import MeasuredTriad, Pose

LABELS = ("L1", "T11", "T9", "T7")
PLACES = (349.0, 398.0, 454.0, 500.0)


def given(
    labels: Sequence[str | None], along: Sequence[float] = PLACES, axis: int = 0
) -> list[LabelledTriad]:
    positions = np.zeros((len(along), 3))
    positions[:, axis] = along
    poses = [Pose(p, np.eye(3), np.zeros((6, 6))) for p in positions]
    return [
        LabelledTriad(label, None, MeasuredTriad("flat", {}, pose, 0.0))
        for label, pose in zip(labels, poses, strict=True)
    ]


def details(triads: list[LabelledTriad], axis: Any = "auto", **more: Any) -> list[str]:
    flags = manual_label_flags(triads, LABELS, axis, **more)
    assert all(flag.code == "levels-implausible" for flag in flags)
    return [flag.detail for flag in flags]


@pytest.mark.parametrize("labels", [LABELS, ("L1", None, "T9", "T7"), ("L1", None, None, None), (None,) * 4])
@pytest.mark.parametrize("axis", ["x", "auto"])
def test_labels_in_the_order_of_the_surgery_are_plausible(labels: tuple[str | None, ...], axis: str) -> None:
    assert details(given(labels), axis) == []


def test_exchanged_labels_are_named_in_both_orders() -> None:
    (detail,) = details(given(("L1", "T9", "T11", "T7")))
    assert detail == (
        "the labels in order along x are L1, T9, T11, T7, and the vertebrae of the surgery L1, T11, T9, T7; look"
        " whether two were exchanged, and correct the labels"
    )
    assert "along y" in details(given(("L1", "T9", "T11", None), axis=1))[0]


def test_the_reverse_order_contradicts_the_declared_direction() -> None:
    (detail,) = details(given(LABELS[::-1]))
    assert "are T7, T9, T11, L1" in detail
    assert "look which end is cranial" in detail
    assert "look which end is cranial" in details(given(("T11", None, None, "L1")))[0]


def test_labels_in_order_that_the_distances_contradict_are_implausible() -> None:
    (detail,) = details(given(("L1", "T7", None, None)))
    assert "check the names of the vertebrae" in detail
    fused = (0.0, 20.0, 75.0, 130.0)
    known = {
        triad.label: triad.triad.pose for triad in given(LABELS, fused) if triad.label and triad.triad.pose
    }
    assert details(given(LABELS, fused))
    assert details(given(LABELS, fused), known=KnownConfiguration(poses=known)) == []


def test_across_the_axis_the_distances_alone_are_compared() -> None:
    across = given(LABELS, axis=1)
    across[1].triad.pose.position_mm[0] = -0.1  # type: ignore[union-attr]
    assert details(across, "x") == []
    assert "mm per level" in details(given(("L1", "T9", "T11", "T7"), axis=1), "x")[0]
