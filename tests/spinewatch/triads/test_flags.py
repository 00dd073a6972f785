from dataclasses import replace

import numpy as np

from spinewatch.triads.flags import TRIAD_FLAGS, triad_flags
from tests.contract.results import ball, labelled

TRIAD = labelled().triad


def codes(*triads: object, expected: int | None = None) -> list[str]:
    return [flag.code for flag in triad_flags(triads, expected)]  # type: ignore[arg-type]


def test_triads_in_full_view_have_none() -> None:
    assert codes(TRIAD, TRIAD, expected=2) == []


def test_hidden_and_manual_balls_are_named() -> None:
    hidden = replace(TRIAD, balls={"XX": replace(ball(), right_px=None), "YY": ball()})
    placed = replace(TRIAD, balls={"XX": replace(ball(), manual_in=("left", "right"))})
    flags = triad_flags([hidden, placed], None)
    assert [flag.code for flag in flags] == ["ball-occluded", "ball-manual"]
    assert "ball XX in the left and right image" in flags[1].detail
    assert flags[1].detail.startswith("triad 2")


def test_numbers_and_missing_poses() -> None:
    incomplete = replace(TRIAD, pose=None, reason="unknown")
    assert codes(incomplete, TRIAD, expected=2) == ["triad-incomplete", "triad-count-low"]
    assert codes(TRIAD, TRIAD, expected=1) == ["triad-count-high"]
    assert set(codes(incomplete, expected=2)) <= TRIAD_FLAGS
    assert np.isfinite(TRIAD.error_mm)
