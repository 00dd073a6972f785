import re
from collections.abc import Sequence

import numpy as np
import pytest

from spinewatch.levels import level_numbers
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.spacing import SpacingParameters, implausible_spacing


def problem(
    labels: str,
    gaps_mm: Sequence[float],
    extra: Sequence[str] = (),
    parameters: SpacingParameters | None = None,
) -> str | None:
    names = labels.split(",")
    positions = np.zeros((len(names), 3))
    positions[1:, 0] = np.cumsum(gaps_mm)
    numbers = np.array(level_numbers(names, extra))
    return implausible_spacing(positions, numbers, extra, parameters or SpacingParameters())


@pytest.mark.parametrize(
    ("labels", "gaps_mm"),
    [
        ("L1,T11,T9,T7", (50, 58, 47)),
        ("T7,T9,T11,L1", (47, 58, 50)),
        ("L4,L3,L2,L1,T12,T11", (38, 37, 35, 32, 30)),  # the lengths of a tall adult grow downwards
        ("T5,T4,T3,T2,T1", (17, 16.5, 16, 16)),  # a small adolescent
        ("C7,C5,C3", (30, 28)),
        ("S1,L5", (28,)),
        ("L1,T7", (150,)),
    ],
)
def test_distances_of_a_spine_are_plausible(labels: str, gaps_mm: Sequence[float]) -> None:
    assert problem(labels, gaps_mm) is None


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        ("L1,T12,T11,T10", "50.0 mm per level instead of 12 to 45"),
        ("L5,L1,T9,T1", "T9 and T1 are 47 mm apart, 5.9 mm per level"),
        ("L1,T11,T10,T7", "T11 and T10 are 58 mm apart, 58.0 mm per level"),
        ("L4,T11,T9,T7", "10.0 mm per level"),
        (
            "L2,T11,T9,T7",
            r"fit L1,T11,T9,T7 \d+ times better \(25.0, 29.0, 23.5 mm per level\) than L2,T11,T9,T7",
        ),
    ],
)
def test_wrong_names_are_seen_with_the_numbers(labels: str, words: str) -> None:
    found = problem(labels, (50, 58, 47))
    assert found is not None
    assert re.search(words, found)


def test_names_that_are_all_shifted_or_reversed_are_not_seen() -> None:
    assert problem("L2,T12,T10,T8", (50, 58, 47)) is None
    assert problem("T7,T9,T11,L1", (50, 58, 47)) is None


def test_an_extra_level_counts() -> None:
    assert problem("L1,T12", (52,), ("T13",)) is None
    assert "52.0 mm per level" in str(problem("L1,T12", (52,)))


def test_the_needed_ratio_and_the_limits_are_parameters() -> None:
    assert (
        problem("L2,T11,T9,T7", (50, 58, 47), parameters=SpacingParameters(min_likelihood_ratio=1e4)) is None
    )
    assert problem("L2,L1", (60,), parameters=SpacingParameters(lumbar_mm=(15.0, 70.0))) is None
    assert problem("L2,T11,T9,T7", (50, 58, 47), parameters=SpacingParameters(max_shift=0)) is None


@pytest.mark.parametrize("spacing_mm", [22.0, 27.0, 32.0])
def test_sound_chains_raise_no_alarm(spacing_mm: float) -> None:
    labels = ("L3", "L1", "T10", "T9", "T7")
    numbers = np.array(level_numbers(labels))
    rng = np.random.default_rng(11)
    alarms = 0
    for _ in range(200):
        poses = random_spine(
            rng, len(labels), spacing_mm=spacing_mm, steps=np.abs(np.diff(numbers)).tolist(), bend_deg=40.0
        )
        positions = np.stack([pose.position_mm for pose in poses])
        alarms += implausible_spacing(positions, numbers, (), SpacingParameters()) is not None
    assert alarms <= 2


def test_most_chains_with_one_name_wrong_by_a_level_are_seen() -> None:
    rng = np.random.default_rng(12)
    seen = 0
    for _ in range(200):
        poses = random_spine(rng, 4, spacing_mm=27.0, steps=(2, 2, 2))
        positions = np.stack([pose.position_mm for pose in poses])
        numbers = np.array(level_numbers(("L1", "T11", "T10", "T7")))
        seen += implausible_spacing(positions, numbers, (), SpacingParameters()) is not None
    assert seen >= 195
