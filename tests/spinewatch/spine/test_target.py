from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.target import (
    PlannedVertebra,
    TargetError,
    check_target,
    remaining_motion,
    target_configuration,
    target_measures,
)
from tests.spinewatch.spine.spines import errors, tilted

SPINE = replace(tilted([-25.0, -20.0, 0.0, 20.0, 30.0], 5.0, -9.0), errors={"triads A": errors(5, 0.4, 1.0)})
LEVELS = SPINE.levels


def planned(vertebra: str, *angles: float, position: list[float] | None = None) -> PlannedVertebra:
    return PlannedVertebra(vertebra, np.array(angles), None if position is None else np.array(position))


PLAN = [planned(level, coronal, 0.0, 0.0) for level, coronal in zip(LEVELS, (-5, -3, 0, 3, 5), strict=True)]


def test_what_remains_is_the_plan_less_what_is() -> None:
    (first,) = remaining_motion(SPINE, [planned("L3", -5.0, 2.0, 0.0, position=[1.0, 2.0, 90.0])], "L5")
    assert first.angles_deg == pytest.approx([-5.0, -3.0, 9.0])
    assert first.angles_sd_deg == pytest.approx([1.0, 1.0, 1.0], rel=0.01)
    assert first.translation_mm == pytest.approx([1, 2, 90] - SPINE.poses.position_mm[2])
    assert first.translation_sd_mm == pytest.approx(np.full(3, 0.4 * np.sqrt(2)))


def test_positions_are_counted_from_the_reference_vertebra() -> None:
    moved = replace(SPINE, poses=SpinePoses(SPINE.poses.position_mm + 7.0, SPINE.poses.rotation))
    plan = [planned("L1", 0.0, 0.0, 0.0, position=[1.0, 2.0, 90.0])]
    for spine in (SPINE, moved):
        (found,) = remaining_motion(spine, plan, "L5")
        assert found.translation_mm == pytest.approx([1, 2, 90] - SPINE.poses.position_mm[0])
    (found,) = remaining_motion(SPINE, plan, "T1")
    assert np.isnan(found.translation_mm).all()
    assert np.isfinite(found.angles_deg).all()


def test_nothing_is_said_without_a_plan_or_a_pose() -> None:
    rotation = SPINE.poses.rotation.copy()
    rotation[0] = np.nan
    spine = replace(SPINE, poses=SpinePoses(SPINE.poses.position_mm, rotation))
    (found,) = remaining_motion(spine, PLAN[:1], "L5")
    for numbers in (found.angles_deg, found.angles_sd_deg, found.translation_mm, found.translation_sd_mm):
        assert np.isnan(numbers).all()


def test_measures_of_the_target() -> None:
    values = {m.definition: m for m in target_measures(SPINE, SPINE, PLAN, "L5")}
    assert values["cobb-fixed"].value == pytest.approx(10.0 - 55.0)
    assert values["cobb-fixed"].sd == pytest.approx(np.sqrt(2), rel=0.01)
    assert values["apical-rotation"].value == pytest.approx(9.0)
    translation = values["apical-translation"]
    assert translation.status is MeasureStatus.NOT_MEASURED
    assert translation.reason == "at the later stage L3 was not measured: its position is not planned"
    partly = {m.definition: m for m in target_measures(SPINE, SPINE, PLAN[1:], "L5")}
    assert partly["cobb-fixed"].reason == "at the later stage L1 was not measured: it is not planned"


def test_a_planned_apical_translation() -> None:
    spine = replace(SPINE, reference="L5")
    plan = [*PLAN[:2], planned("L3", 0.0, 0.0, 0.0, position=[0.0, -4.0, 50.0]), *PLAN[3:]]
    values = {m.definition: m for m in target_measures(spine, spine, plan, "L5")}
    change = values["apical-translation"]
    assert change.value == pytest.approx(4.0 + spine.poses.position_mm[2, 1] - spine.poses.position_mm[4, 1])
    assert change.sd == pytest.approx(0.4 * np.sqrt(2))


def test_a_planned_position_moves_with_the_error_of_the_reference() -> None:
    found = target_configuration(SPINE, [planned("L3", 0.0, 0.0, 0.0, position=[0.0, -4.0, 50.0])], "L5")
    assert found.poses.position_mm[2] == pytest.approx(SPINE.poses.position_mm[4] + [0.0, -4.0, 50.0])
    assert found.poses.position_mm[4] == pytest.approx(SPINE.poses.position_mm[4])
    assert np.isnan(found.poses.position_mm[:2]).all()
    assert found.marked == (False, False, True, False, False)
    factor = found.errors["triads A"]
    assert np.array_equal(factor[2, :3], SPINE.errors["triads A"][4, :3])
    assert not factor[:, 3:].any()


@pytest.mark.parametrize(
    ("plan", "sentence"),
    [
        ([], "names no vertebra"),
        ([planned("T4", 0, 0, 0)], "plans T4, which this spine does not have"),
        ([planned("L1", 0, 0, 0), planned("L1", 1, 0, 0)], "plans L1 more than once"),
        ([planned("L1", np.nan, 0, 0)], "of L1 has a number that is not finite"),
        ([planned("L1", 0, 0, 0, position=[0, np.inf, 0])], "of L1 has a number that is not finite"),
        ([planned("L1", 0, 95.0, 0)], "of L1 has a tilt of 95 degrees"),
        ([planned("L1", 0, 0, -1e300)], r"of L1 has an axial rotation of -1e\+300 degrees"),
        ([planned("L1", 0, 0, 0, position=[0, 0, 1e300])], "of L1 is beyond 10 m"),
    ],
)
def test_a_plan_for_another_spine_is_refused(plan: list[PlannedVertebra], sentence: str) -> None:
    with pytest.raises(TargetError, match=sentence):
        check_target(plan, LEVELS)
    with pytest.raises(TargetError):
        remaining_motion(SPINE, plan, "L5")
    with pytest.raises(TargetError):
        target_measures(SPINE, SPINE, plan, "L5")
