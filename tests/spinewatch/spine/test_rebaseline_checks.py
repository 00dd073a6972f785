"""A marker is clamped again while the spine rests; the others tell when it did not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.spine.configuration import Rebaseline
from spinewatch.spine.rebaseline_checks import RebaselineParameters, rebaseline_flags
from spinewatch.triads.pose import Pose
from tests.spinewatch.spine.simulated import Surgery, covariance_of, disturbed, moved, surgery, turn

MARKED = ("T8", "T9", "T11", "L1")
SETTLING = np.array([0.5] * 6)


def measured(
    seed: int,
    motion_deg: float = 0.0,
    marked: Sequence[str] = MARKED,
    settling: Float | None = None,
    clamped: Sequence[str] = ("T9",),
) -> Surgery:
    """Return a surgery whose poses err, and whose marker is elsewhere from INTER on."""
    case = surgery(seed, marked, motion_deg=motion_deg)
    rng = np.random.default_rng([seed, 2])
    stages: dict[str, dict[str, Pose]] = {}
    for number, (stage, poses) in enumerate(case.stages.items()):
        # A spine that rests is seen from elsewhere.
        source = case.stages["PRE"] if motion_deg == 0 else poses
        cart = (turn(*rng.uniform(-6, 6, 3)), rng.uniform(-60, 60, 3))
        stages[stage] = {}
        for name in poses:
            pose = moved(source[name], *cart)
            if number and name in clamped:
                pose = Pose(pose.position_mm + 5.0, pose.rotation @ turn(20, -10, 30), pose.covariance)
            if number and settling is not None:
                pose = disturbed(pose, settling * rng.standard_normal(6))
            noisy = Pose(pose.position_mm, pose.rotation, covariance_of(rng, 1.0))
            stages[stage][name] = disturbed(
                noisy, np.linalg.cholesky(noisy.covariance) @ rng.standard_normal(6)
            )
    again = tuple(Rebaseline(name, "PRE", "INTER") for name in clamped)
    return Surgery(replace(case.setup, rebaselines=again), stages, case.truth)


def flags(
    case: Surgery, stage: str = "INTER", parameters: RebaselineParameters | None = None
) -> tuple[Flag, ...]:
    return rebaseline_flags(case.setup, case.stages, stage, parameters)


@pytest.mark.parametrize("settling", [None, SETTLING])
def test_a_spine_that_rests_raises_nothing(settling: Float | None) -> None:
    for seed in range(60):
        assert flags(measured(seed, settling=settling)) == ()


def test_a_spine_that_moved_is_named_at_all_stages_beyond() -> None:
    for seed in range(10):
        case = measured(seed, motion_deg=15.0)
        assert flags(case, "PRE") == ()
        for stage in ("INTER", "POST"):
            (flag,) = flags(case, stage)
            assert flag.code == "rebaseline-moved"
            assert flag.detail.startswith(
                "T9 was clamped again between PRE and INTER, but the spine moved: T"
            )
            assert "against the reference L1" in flag.detail
            assert "T9 by" not in flag.detail


def test_markers_that_were_clamped_again_meanwhile_do_not_count() -> None:
    assert flags(measured(1, clamped=("T9", "T11"))) == ()
    one_forgotten = measured(1, clamped=("T9", "T11"))
    setup = replace(one_forgotten.setup, rebaselines=one_forgotten.setup.rebaselines[:1])
    (flag,) = flags(replace(one_forgotten, setup=setup))
    assert flag.code == "rebaseline-moved"
    assert "T11 by" in flag.detail


def test_nothing_that_stayed_in_place_is_said() -> None:
    (flag,) = flags(measured(2, marked=("T9", "L1")))
    assert flag.code == "rebaseline-unchecked"
    assert "the reference L1 shows" in flag.detail


def test_a_marker_or_reference_without_a_pose_has_no_motion_to_doubt() -> None:
    case = measured(3, motion_deg=15.0)
    for missing in ("T9", "L1"):
        stages = {
            stage: {n: p for n, p in poses.items() if n != missing} for stage, poses in case.stages.items()
        }
        assert flags(replace(case, stages=stages)) == ()


def test_a_rebaseline_that_the_stage_does_not_need_says_nothing() -> None:
    case = measured(4, motion_deg=15.0)
    later = replace(case.setup, rebaselines=(Rebaseline("T9", "INTER", "POST"),))
    assert flags(replace(case, setup=later), "INTER") == ()
    assert flags(replace(case, setup=later), "POST")
    baseline_last = replace(case.setup, baseline="POST")
    assert flags(replace(case, setup=baseline_last), "PRE")


def test_parameters_are_used() -> None:
    case = measured(5, motion_deg=15.0)
    assert flags(case, parameters=RebaselineParameters(settling_mm=50.0, settling_deg=50.0)) == ()
    assert flags(measured(5), parameters=RebaselineParameters(significance=1.0))
