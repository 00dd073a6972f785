"""The parts of an assessment are those that the library gives one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.assessment import SpineParameters, assess_stage
from spinewatch.spine.bodies import StageMissingError
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.configuration import Rebaseline
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.orientation import tilts_of
from spinewatch.spine.plausibility import PlausibilityParameters
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.spine.target import PlannedVertebra
from tests.spinewatch.spine.simulated import surgery

OTHER = SpineParameters(plausibility=PlausibilityParameters(sigma=2.5))


def test_the_baseline_is_compared_with_nothing() -> None:
    case = surgery(1, noise=0.5)
    found = assess_stage(case.setup, case.stages, "PRE", parameters=OTHER)
    assert found.since_baseline is None
    assert found.since_previous is None
    assert found.remaining is None
    assert found.target_measures is None
    assert found.flags == ()
    tilts = {value.levels[0]: value.value for value in found.vertebrae if value.definition == "coronal-tilt"}
    assert list(tilts) == list(found.configuration.levels)
    assert list(tilts.values()) == pytest.approx(tilts_of(case.truth["PRE"].rotation)[0])


def test_changes_are_those_since_the_baseline_and_since_the_stage_before() -> None:
    case = surgery(2, noise=0.5)
    found = assess_stage(case.setup, case.stages, "POST", "INTER", parameters=OTHER)
    spines = {name: spine_at_stage(case.setup, case.stages, name) for name in case.stages}
    assert repr(found.measured) == repr(measure_spine(spines["POST"], spines["PRE"], OTHER.measures))
    for change, start in ((found.since_baseline, "PRE"), (found.since_previous, "INTER")):
        assert change is not None
        expected = vertebra_changes(spines[start], spines["POST"], case.setup.reference)
        for got, want in zip(change.vertebrae, expected, strict=True):
            np.testing.assert_array_equal(got.translation_mm, want.translation_mm)
            np.testing.assert_array_equal(got.rotation_sd_deg, want.rotation_sd_deg)
        assert {value.definition for value in change.measures} >= {"cobb-fixed"}
        assert change.attribution


def test_the_second_stage_has_one_change() -> None:
    case = surgery(3, noise=0.5)
    found = assess_stage(case.setup, case.stages, "INTER", "PRE", parameters=OTHER)
    assert found.since_previous is found.since_baseline is not None


def test_what_remains_to_the_target() -> None:
    case = surgery(4, noise=0.5)
    now = case.truth["POST"]
    level = case.setup.initial.levels[2]
    tilts = np.array([float(angle[2]) for angle in tilts_of(now.rotation)])
    target = [PlannedVertebra(level, tilts + np.array([3.0, -2.0, 1.0]))]
    found = assess_stage(case.setup, case.stages, "POST", "INTER", target, parameters=OTHER)
    assert found.remaining is not None
    assert found.remaining[0].vertebra == level
    assert found.remaining[0].angles_deg == pytest.approx([3.0, -2.0, 1.0], abs=1e-6)
    assert found.target_measures is not None


def test_a_marker_clamped_again_says_nothing_of_the_motion_since_the_stage_before() -> None:
    case = surgery(5, noise=0.5)
    level = case.setup.initial.levels[0]
    strict = replace(OTHER, plausibility=PlausibilityParameters(max_growth=1e-9, sigma=0.0))
    found = assess_stage(case.setup, case.stages, "POST", "INTER", parameters=strict)
    assert any(level in flag.detail for flag in found.flags)
    clamped = replace(case.setup, rebaselines=(Rebaseline(level, "INTER", "POST"),))
    again = assess_stage(clamped, case.stages, "POST", "INTER", parameters=strict)
    of_motion = [flag for flag in again.flags if flag.code != "rebaseline-moved"]
    assert not any(level in flag.detail for flag in of_motion)
    assert len(again.flags) - len(of_motion) == 1


def test_a_stage_that_was_not_given_is_named() -> None:
    case = surgery(6, noise=0.5)
    with pytest.raises(StageMissingError, match="NEVER"):
        assess_stage(case.setup, case.stages, "NEVER", parameters=OTHER)
