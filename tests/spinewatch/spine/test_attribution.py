from dataclasses import replace

import numpy as np
import pytest

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.attribution import attribute
from spinewatch.spine.changes import LevelsDifferError
from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.measure_changes import measure_changes
from spinewatch.spine.results import Attribution, MeasureStatus
from tests.spinewatch.spine.spines import LEVELS, disturbed, errors, scoliosis, tilted

BENT = tilted([-25.0, -20.0, 0.0, 20.0, 30.0], sagittal_deg=[10.0, 5.0, 0.0, -5.0, -10.0])
MOVING = {"curve 1", "curve 2", "curve 3", *LEVELS} - {"L5"}
"""What moves in `scoliosis` with respect to L5."""


def of(found: tuple[Attribution, ...], subject: str, quantity: str) -> Attribution:
    return next(a for a in found if (a.subject, a.quantity) == (subject, quantity))


def turned(spine: SpineConfiguration, degrees: float) -> SpineConfiguration:
    R = rotation_from_vector(np.radians([0.0, 0.0, degrees]))
    return replace(spine, poses=SpinePoses(spine.poses.position_mm @ R.T, R @ spine.poses.rotation))


def test_a_rigid_turn_is_rotation_alone() -> None:
    found = attribute(BENT, turned(BENT, -40.0), BENT, "L5")
    cobb = of(found, "curve 1", "cobb-fixed")
    assert cobb.total.value < -5
    assert cobb.rotation.value == pytest.approx(cobb.total.value)
    assert (cobb.distraction.value, cobb.remainder.value) == pytest.approx((0.0, 0.0), abs=1e-9)
    for name in ("L1", "L2", "L3", "L4"):
        vertebra = of(found, name, "lateral-displacement")
        assert vertebra.rotation.value == pytest.approx(vertebra.total.value)
        assert vertebra.distraction.value == pytest.approx(0.0, abs=1e-9)


def test_pure_distraction_along_the_segments_is_no_rotation() -> None:
    longer = replace(BENT, poses=SpinePoses(1.1 * BENT.poses.position_mm, BENT.poses.rotation))
    found = attribute(BENT, longer, BENT, "L5")
    cobb = of(found, "curve 1", "cobb-fixed")
    assert (cobb.total.value, cobb.rotation.value, cobb.distraction.value) == pytest.approx(
        (0, 0, 0), abs=1e-9
    )
    for name in ("L1", "L2", "L3", "L4"):
        vertebra = of(found, name, "lateral-displacement")
        y = BENT.poses.position_mm[BENT.index(name), 1]
        assert vertebra.total.value == pytest.approx(-0.1 * y)
        assert vertebra.distraction.value == pytest.approx(vertebra.total.value)
        assert vertebra.rotation.value == pytest.approx(0.0, abs=1e-9)


def test_straightening_in_its_plane_is_distraction_of_the_curve() -> None:
    start, end = tilted([-30.0, -10.0, 10.0, 30.0]), tilted([-12.0, -4.0, 4.0, 12.0])
    cobb = of(attribute(start, end, start, "L5"), "curve 1", "cobb-fixed")
    assert (cobb.total.value, cobb.distraction.value) == pytest.approx((-36.0, -36.0))
    assert cobb.rotation.value == pytest.approx(0.0, abs=1e-9)


def test_the_apical_translation_is_that_of_the_apex() -> None:
    end = scoliosis(0.5)
    found = attribute(scoliosis(), end, scoliosis(), "L5")
    apex = next(
        m for m in measure_changes(scoliosis(), end, scoliosis()) if m.definition == "apical-translation"
    )
    share = of(found, "curve 1", "apical-translation")
    assert share.total.value == pytest.approx(apex.value)
    assert share.rotation == of(found, apex.levels[0], "lateral-displacement").rotation
    assert share.rotation.value + share.distraction.value == pytest.approx(share.total.value)


def test_the_apex_may_be_the_reference() -> None:
    found = attribute(BENT, BENT, BENT, "L3")
    assert of(found, "curve 1", "apical-translation").reason == "the apex L3 is the reference vertebra"
    assert {a.subject for a in found} == {"curve 1", "L1", "L2", "L4", "L5"}


def test_parts_add_up_with_deviations_and_intervals() -> None:
    rng = np.random.default_rng(0)
    factors = {"initial": errors(17), "triads POST": errors(17)}
    units = {source: rng.standard_normal(102) for source in factors}
    before = disturbed(scoliosis(), {"initial": factors["initial"]}, units)
    after = disturbed(scoliosis(0.5, 0.6, 1.2), factors, units)
    found = attribute(before, after, before, "L5")
    assert {a.subject for a in found} == MOVING
    for a in found:
        assert a.reason is None
        total = a.rotation.value + a.distraction.value + a.remainder.value
        assert total == pytest.approx(a.total.value, abs=1e-9)
        whole = (a.total, a.rotation, a.distraction)
        for share in (*whole, a.remainder) if a.quantity == "cobb-fixed" else whole:
            assert share.sd > 0
            assert share.upper - share.value == pytest.approx(1.959964 * share.sd, rel=1e-6)
            assert share.value - share.lower == pytest.approx(1.959964 * share.sd, rel=1e-6)


def test_shared_errors_cancel() -> None:
    shared = {"initial": errors(17, 0.5, 2.0)}
    before, after = (replace(s, errors=shared) for s in (scoliosis(), scoliosis(0.98)))
    found = attribute(before, after, before, "L5")
    assert {a.subject for a in found} == MOVING
    for a in found:
        assert a.total.sd < 0.1


def test_the_way_goes_along_marked_vertebrae() -> None:
    # L2 has no marker: its bulge does not belong to the way from L5 to L1.
    marked = (True, False, True, True, True)
    start = replace(BENT, marked=marked)
    position = BENT.poses.position_mm.copy()
    position[1] += [0.0, -6.0, 0.0]
    end = replace(start, poses=SpinePoses(position, BENT.poses.rotation))
    found = attribute(start, end, BENT, "L5")
    assert of(found, "L1", "lateral-displacement").rotation.value == 0.0
    assert of(found, "L2", "lateral-displacement").total.value == pytest.approx(6.0)


def test_other_interpolations_widen_the_interval() -> None:
    other = SpinePoses(
        BENT.poses.position_mm + np.array([0.0, 3.0, 0.0]), tilted([-31.0, -20, 0, 20, 30]).poses.rotation
    )
    origins = (Origin.INTERPOLATED, *BENT.origins[1:])
    position = other.position_mm.copy()
    position[1:] = BENT.poses.position_mm[1:]
    after = replace(BENT, origins=origins, alternatives=(SpinePoses(position, other.rotation),))
    found = attribute(BENT, after, BENT, "L5")
    vertebra = of(found, "L1", "lateral-displacement").total
    assert (vertebra.lower, vertebra.upper) == pytest.approx((-3.0, 0.0), abs=1e-9)
    cobb, apex = (of(found, "curve 1", quantity) for quantity in ("cobb-fixed", "apical-translation"))
    assert cobb.total.upper > 5.0
    assert (cobb.levels, cobb.status, cobb.assumed) == (("L1", "L5"), MeasureStatus.BRACKETED, False)
    assert cobb.reason == "L1 has no marker at this stage"
    changes = {m.definition: m for m in measure_changes(BENT, after, BENT)}
    for part in (cobb, apex):
        change = changes[part.quantity]
        assert (part.levels, part.status, part.reason) == (change.levels, change.status, change.reason)


def test_what_depends_on_an_assumed_configuration_says_so() -> None:
    start, end = (replace(s, assumed=True) for s in (scoliosis(), scoliosis(0.5)))
    found = attribute(start, end, start, "L5")
    assert {(a.assumed, a.status) for a in found} == {(True, MeasureStatus.MEASURED)}


def test_an_undetermined_plane_leaves_the_total() -> None:
    after = replace(tilted([0.0, 1.0, 0.5, 0.0, 0.2]), errors={"triads POST": errors(5)})
    cobb = of(attribute(BENT, after, BENT, "L5"), "curve 1", "cobb-fixed")
    assert cobb.total.value == pytest.approx(-54.8)
    assert np.isnan([cobb.rotation.value, cobb.distraction.value, cobb.remainder.value]).all()
    assert (cobb.reason or "").startswith("at the later stage L1 and L5 are so nearly parallel")


def test_why_a_change_is_bracketed_is_kept_where_the_plane_is_not_determined() -> None:
    after = replace(tilted([0.0, 1.0, 0.5, 0.0, 0.2]), errors={"triads POST": errors(5)})
    after = replace(
        after, origins=(Origin.INTERPOLATED, *after.origins[1:]), marked=(False, *after.marked[1:])
    )
    cobb = of(attribute(BENT, after, BENT, "L5"), "curve 1", "cobb-fixed")
    first, _, second = (cobb.reason or "").partition("; ")
    assert first == "L1 has no marker at this stage"
    assert second.startswith("at the later stage")


def test_a_plane_that_is_too_uncertain_for_first_order_leaves_the_total() -> None:
    # Coronal tilts are known exactly, so that there is a plane, but not where.
    factor = errors(5) @ np.diag(np.tile([1.0, 1, 1, 0, 20, 1], 5))
    after = replace(BENT, errors={"triads POST": factor})
    planes = [m for m in measure_changes(BENT, after, BENT) if m.definition == "plane-of-maximum-curvature"]
    assert [m.reason for m in planes] == [None]
    cobb = of(attribute(BENT, after, BENT, "L5"), "curve 1", "cobb-fixed")
    assert np.isnan([cobb.rotation.value, cobb.distraction.value]).all()
    assert (cobb.reason or "").startswith("at the later stage the plane of maximum curvature is known to")


def test_missing_vertebrae_have_reasons() -> None:
    position, rotation = BENT.poses.position_mm.copy(), BENT.poses.rotation.copy()
    position[0], rotation[0] = np.nan, np.nan
    after = replace(BENT, poses=SpinePoses(position, rotation), reasons=("it is hidden", *BENT.reasons[1:]))
    found = attribute(BENT, after, BENT, "L5")
    for subject, quantity in (("curve 1", "cobb-fixed"), ("L1", "lateral-displacement")):
        assert of(found, subject, quantity).reason == "at the later stage L1 was not measured: it is hidden"
    assert of(found, "L2", "lateral-displacement").reason is None
    lost = attribute(BENT, after, BENT, "L1")
    assert "of the reference vertebra" in (of(lost, "L3", "lateral-displacement").reason or "")
    other = attribute(BENT, BENT, BENT, "T4")
    assert "no reference vertebra T4" in (of(other, "L3", "lateral-displacement").reason or "")


def test_stages_of_different_spines_are_refused() -> None:
    with pytest.raises(LevelsDifferError, match="different vertebrae"):
        attribute(BENT, scoliosis(), BENT, "L5")


def test_95_percent_intervals_cover_the_truth() -> None:
    truth, later = scoliosis(), scoliosis(0.5, 0.6, 1.2)
    true = attribute(truth, later, truth, "L5")
    factors = {"initial": errors(17), "triads POST": errors(17)}
    covered = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        units = {source: rng.standard_normal(102) for source in factors}
        before = disturbed(truth, {"initial": factors["initial"]}, units)
        found = attribute(before, disturbed(later, factors, units), truth, "L5")
        for f, t in zip(found, true, strict=True):
            for name in ("total", "rotation", "distraction"):
                share = getattr(f, name)
                covered.append(share.lower <= getattr(t, name).value <= share.upper)
    assert len(covered) == 150 * 3 * (6 + len(LEVELS) - 1)
    assert 0.935 <= np.mean(covered) <= 0.965
