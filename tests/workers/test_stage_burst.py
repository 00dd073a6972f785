"""Results of bursts: times of the pairs, triads of the first pair that shows them, flags of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.flags import Flag
from spinewatch.stage import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import Pose
from store.stage_work import PairWork
from tests.contract.results import labelled, measurement
from tests.store.builders import NOON, at
from workers.stage_burst import burst_result, offsets_s, view_delay_s
from workers.stage_labels import LabelledPair


def triad(label: str | None, x_mm: float) -> LabelledTriad:
    pose = Pose(np.array([x_mm, 0.0, 0.0]), np.eye(3), 0.01 * np.eye(6))
    made = labelled(label)
    return replace(made, triad=replace(made.triad, pose=pose))


def measured(*triads: LabelledTriad, flags: tuple[Flag, ...] = ()) -> LabelledPair:
    whole: StageMeasurement = replace(measurement(), triads=triads, flags=flags)
    return LabelledPair(whole)


def pair(seconds: float, delay: float = 0.0) -> PairWork:
    return PairWork(b"", b"", at(seconds), at(seconds + delay))


def test_a_pair_is_at_the_middle_of_its_exposures() -> None:
    pairs = [pair(0, 0.1), pair(2, 0.3)]
    assert [view_delay_s(one) for one in pairs] == [0.1, 0.3]
    assert offsets_s(pairs) == [0.0, 2.1]


def test_one_unknown_time_makes_all_unknown() -> None:
    assert offsets_s([pair(0), PairWork(b"", b"", NOON, None)]) is None
    assert view_delay_s(PairWork(b"", b"", None, NOON)) is None


def test_poses_are_means_and_the_rest_is_of_the_first_pair_that_shows_them() -> None:
    pairs = [pair(0), pair(1, 0.02)]
    both = [measured(triad("L1", 1.0)), measured(triad("L1", 1.1), triad("T9", 50.0))]
    result = burst_result(pairs, both, ("T9", "L1", "T7"), "L1", ("1", {"setting": 3}))
    assert [t.label for t in result.triads] == ["T9", "L1"]
    assert result.triads[1].position_mm is not None
    assert np.isclose(result.triads[1].position_mm[0], 1.05)
    assert result.view_delay_s == 0.02
    assert result.parameters["setting"] == 3
    assert result.burst is not None
    assert [set(p.poses) for p in result.burst.pairs] == [{"L1"}, {"L1", "T9"}]
    assert [p.offset_s for p in result.burst.pairs] == [0.0, 1.01]


def test_flags_of_pairs_are_joined_by_code() -> None:
    one = measured(triad("L1", 1.0))
    pairs = [
        one,
        measured(triad("L1", 1.0), flags=(Flag("image-dark", "left: dark"),)),
        measured(triad("L1", 1.0), flags=(Flag("image-dark", "left: darker"),)),
    ]
    times = [pair(0), pair(1), pair(2)]
    result = burst_result(times, pairs, ("L1",), "L1", ("1", {}))
    flags = {flag.code: flag.detail for flag in result.flags}
    assert flags["image-dark"] == "pair 2: left: dark (and so in 1 more of 3 pairs)"


def test_a_triad_without_a_label_is_shown_as_the_first_pair_has_it() -> None:
    both = [measured(triad(None, 7.0)), measured(triad(None, 9.0))]
    result = burst_result([pair(0), pair(1)], both, ("L1",), "L1", ("1", {}))
    assert [(t.label, t.position_mm) for t in result.triads] == [(None, [7.0, 0.0, 0.0])]
