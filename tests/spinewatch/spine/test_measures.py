from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.curves import find_curves
from spinewatch.spine.evaluation import Evaluation, MeasureRequest, evaluate
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import (
    evaluate_reselected,
    interval_of,
    measure_spine,
    not_measured,
    plane_reason,
    stage_value,
)
from spinewatch.spine.plane_vector import PlaneVector
from spinewatch.spine.reselection import reselection_windows
from spinewatch.spine.results import MeasureStatus, MeasureValue
from spinewatch.spine.uncertainty import QUANTILE_95, common_factors
from tests.spinewatch.spine.spines import disturbed, errors, scoliosis, tilted

PARAMETERS = MeasureParameters()
MIRROR = np.diag([1.0, -1.0, 1.0])
SYMMETRIC = {"kyphosis", "lordosis", "angle-3d"}
ALL = {
    "cobb-fixed", "cobb-reselected", "apical-rotation", "apical-rotation-projected", "apical-translation", "ferguson",
    "angle-3d", "plane-of-maximum-curvature", "kyphosis", "lordosis", "coronal-balance",
}  # fmt: skip
"""Definitions of the measures of `scoliosis`."""


def measure(spine: SpineConfiguration, definition: str, curve: str | None = "curve 1") -> MeasureValue:
    return next(
        m for m in measure_spine(spine, spine).measures if (m.definition, m.curve) == (definition, curve)
    )


def noisy(seed: int) -> SpineConfiguration:
    return disturbed(
        scoliosis(),
        {"triads A": errors(17)},
        {"triads A": np.random.default_rng(seed).standard_normal(102)},
    )


def test_a_right_curve_by_hand() -> None:
    spine = tilted(
        [-25.0, -20.0, 0.0, 20.0, 30.0], sagittal_deg=[10.0, 5.0, 0.0, -5.0, -10.0], axial_deg=-8.0
    )
    found = measure_spine(spine, spine)
    values = {m.definition: m.value for m in found.measures}
    assert values["cobb-fixed"] == pytest.approx(55.0)
    assert values["cobb-reselected"] == pytest.approx(55.0)
    assert values["apical-rotation"] == pytest.approx(-8.0)
    assert values["lordosis"] == pytest.approx(-20.0)
    assert values["apical-translation"] > 0
    assert values["ferguson"] > 0
    assert 60 < values["plane-of-maximum-curvature"] < 80
    kyphosis = measure(spine, "kyphosis", None)
    assert kyphosis.status is MeasureStatus.NOT_MEASURED
    assert kyphosis.reason == "the configuration of the spine has no T5"


def test_every_value_has_a_deviation_and_an_interval() -> None:
    spine = noisy(0)
    measures = measure_spine(spine, spine).measures
    assert {m.definition for m in measures} == ALL
    for m in measures:
        assert m.status is MeasureStatus.MEASURED
        assert m.sd > 0
        assert m.lower < m.value < m.upper
        assert not m.assumed


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_a_mirror_flips_the_signs_that_it_must_and_no_deviation(seed: int) -> None:
    spine = noisy(seed)
    flip = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    mirrored = replace(
        spine,
        poses=SpinePoses(spine.poses.position_mm @ MIRROR, MIRROR @ spine.poses.rotation @ MIRROR),
        errors={source: flip @ factor for source, factor in spine.errors.items()},
    )
    measures = measure_spine(spine, spine).measures
    assert {m.definition for m in measures} == ALL
    for a, b in zip(measures, measure_spine(mirrored, mirrored).measures, strict=True):
        assert (a.definition, a.levels) == (b.definition, b.levels)
        assert b.value == pytest.approx(a.value if a.definition in SYMMETRIC else -a.value, abs=1e-6)
        assert b.sd == pytest.approx(a.sd, abs=1e-6)


def test_fixed_levels_are_those_of_the_baseline() -> None:
    before = tilted([-25.0, -20.0, 0.0, 20.0, 30.0])
    after = tilted([-5.0, -12.0, 0.0, 10.0, 8.0])
    values = {m.definition: m for m in measure_spine(after, before).measures}
    assert values["cobb-fixed"].value == pytest.approx(13.0)
    assert values["cobb-fixed"].levels == ("L1", "L5")
    assert values["cobb-reselected"].value == pytest.approx(22.0)
    assert values["cobb-reselected"].levels == ("L2", "L4")


def test_an_end_vertebra_without_a_marker_is_bracketed() -> None:
    spine = replace(
        tilted([-25.0, -20.0, 0.0, 20.0, 30.0]),
        errors={"triads A": errors(5)},
        alternatives=(tilted([-25.0, -20.0, 0.0, 20.0, 34.0]).poses,),
    )
    spine = replace(spine, origins=(*spine.origins[:4], Origin.INTERPOLATED))
    for definition in ("cobb-fixed", "cobb-reselected"):
        cobb = measure(spine, definition)
        assert cobb.status is MeasureStatus.BRACKETED
        assert cobb.reason == "L5 has no marker at this stage"
        assert cobb.lower < cobb.value < 59.0 < cobb.upper
    cobb = measure(spine, "cobb-fixed")
    assert cobb.upper == pytest.approx(59.0 + QUANTILE_95 * np.sqrt(2))


def test_an_assumed_configuration_makes_every_measure_assumed() -> None:
    spine = replace(scoliosis(), assumed=True)
    measures = measure_spine(spine, spine).measures
    assert {m.definition for m in measures} == ALL
    assert all(m.assumed for m in measures)


def test_a_marker_that_is_lost_at_the_stage_is_a_reason() -> None:
    before = tilted([-25.0, -20.0, 0.0, 20.0, 30.0])
    position, rotation = before.poses.position_mm.copy(), before.poses.rotation.copy()
    position[4], rotation[4] = np.nan, np.nan
    after = replace(
        before, poses=SpinePoses(position, rotation), reasons=(None,) * 4 + ("its triad was not found",)
    )
    values = {m.definition: m for m in measure_spine(after, before).measures}
    assert values["cobb-fixed"].reason == "L5 was not measured: its triad was not found"
    again = values["cobb-reselected"]
    assert (again.status, again.levels) == (MeasureStatus.BRACKETED, ("L1", "L4"))
    assert again.reason == "L5 was not measured and took no part"


def test_the_plane_of_a_straight_curve_is_not_determined() -> None:
    tilts = [0.0, 1.0, 0.5, 0.0, 0.2]
    spine = replace(tilted(tilts), errors={"triads A": errors(5)})
    plane = measure(spine, "plane-of-maximum-curvature")
    assert plane.status is MeasureStatus.NOT_MEASURED
    assert "nearly parallel" in (plane.reason or "")
    angle = measure(spine, "angle-3d")
    assert angle.lower == 0.0
    upper, lower = (tilts[spine.index(level)] for level in angle.levels)
    assert angle.value == pytest.approx(abs(lower - upper))
    assert angle.value > 0


def test_of_a_reference_vertebra_at_the_apex_only_the_rotation_at_the_baseline_is_measured() -> None:
    before, after = (
        replace(s, reference="L3") for s in (tilted([-20.0, -10, 0, 10, 20]), tilted([-9.0, -5, 0, 5, 9]))
    )
    for spine, rotation in ((before, MeasureStatus.MEASURED), (after, MeasureStatus.NOT_MEASURED)):
        found = {m.definition: m for m in measure_spine(spine, before).measures}
        assert found["apical-rotation"].levels == ("L3",)
        assert found["apical-rotation"].status is rotation
        assert found["apical-translation"].status is MeasureStatus.NOT_MEASURED
        assert "L3 is the reference vertebra" in (found["apical-translation"].reason or "")
        assert found["cobb-fixed"].status is MeasureStatus.MEASURED


def test_a_curve_between_neighbours_has_a_cobb_angle_and_says_why_it_has_no_apex() -> None:
    spine = tilted([0.0, 5, 10, 16, 20, -18, -14, -10, -5, 0])
    found = {m.definition: m for m in measure_spine(spine, spine).measures if m.curve == "curve 2"}
    assert found["cobb-fixed"].value == pytest.approx(-38.0)
    for definition in ("apical-rotation", "apical-rotation-projected", "apical-translation", "ferguson"):
        assert found[definition].status is MeasureStatus.NOT_MEASURED
        assert found[definition].reason == "no vertebra lies between T12 and L1, so that none is the apex"


def test_a_curve_that_went_past_zero_is_measured_at_its_extremes() -> None:
    before = replace(tilted([-12.0, -8, 0, 8, 12]), errors={"initial": errors(5, 0.3, 0.5)})
    after = replace(tilted([3.0, 4, 0, -4, -3]), errors={"initial": errors(5, 0.3, 0.5)})
    (again,) = [m for m in measure_spine(after, before).measures if m.definition == "cobb-reselected"]
    assert again.levels == ("L2", "L4")
    assert again.value == pytest.approx(-8.0)
    assert again.status is MeasureStatus.MEASURED
    unsure = replace(after, errors={"initial": errors(5, 0.3, 5.0)})
    (again,) = [m for m in measure_spine(unsure, before).measures if m.definition == "cobb-reselected"]
    assert again.levels[0] != again.levels[1]
    assert again.lower < -8.0 < 0.0 < again.upper


def test_too_few_vertebrae_for_a_curve() -> None:
    spine = tilted([-10.0, 10.0])
    found = measure_spine(spine, spine)
    assert found.curves == ()
    assert found.measures[0].definition == "cobb-fixed"
    assert "fewer than three vertebrae" in (found.measures[0].reason or "")


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_without_errors_there_is_no_deviation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    spine = scoliosis(rng.uniform(0.5, 1.5))
    measures = measure_spine(spine, spine).measures
    assert {m.definition for m in measures} == ALL
    for m in measures:
        assert m.sd == pytest.approx(0.0, abs=1e-9)
        assert m.lower == pytest.approx(m.value, abs=1e-9)


def test_95_percent_intervals_cover_the_truth() -> None:
    truth = scoliosis()
    true = {(m.definition, m.curve, m.levels): m.value for m in measure_spine(truth, truth).measures}
    cobb = {
        m.curve: m.value for m in measure_spine(truth, truth).measures if m.definition == "cobb-reselected"
    }
    covered = []
    for seed in range(150):
        spine = noisy(seed)
        for m in measure_spine(spine, truth).measures:
            value = (
                cobb[m.curve] if m.definition == "cobb-reselected" else true[m.definition, m.curve, m.levels]
            )
            covered.append(m.lower <= value <= m.upper)
    assert 0.94 <= np.mean(covered) <= 0.965


def evaluation(value: float, sd: float, status: MeasureStatus = MeasureStatus.MEASURED) -> Evaluation:
    d = np.array([[np.cos(np.radians(value)), np.sin(np.radians(value))]])
    S = np.radians(sd) ** 2 * np.eye(2)
    return Evaluation(np.array([value]), np.array([sd]), status, None, vector=PlaneVector(d, S))


def test_the_interval_belongs_to_the_measure() -> None:
    found = Evaluation(np.ones(1), np.ones(1), MeasureStatus.MEASURED, None)
    assert interval_of(MeasureRequest("cobb-fixed", None, ()), found) == pytest.approx(
        (1 - QUANTILE_95, 1 + QUANTILE_95)
    )
    angle = replace(found, vector=PlaneVector(np.array([[1.0, 0.0]]), np.eye(2)))
    assert interval_of(MeasureRequest("angle-3d", None, ()), angle) == pytest.approx((0.0, 1 + QUANTILE_95))
    plane = interval_of(MeasureRequest("plane-of-maximum-curvature", None, ()), evaluation(90.0, 15.0))
    assert plane == pytest.approx((90 - 30.88, 90 + 30.88), abs=0.01)


def test_a_plane_needs_a_small_deviation() -> None:
    request = MeasureRequest("plane-of-maximum-curvature", "curve 1", ("T5", "T12"))
    assert plane_reason(request, evaluation(90.0, 19.0), PARAMETERS) is None
    reason = plane_reason(request, evaluation(90.0, 25.0), PARAMETERS)
    assert (
        reason
        == "T5 and T12 are so nearly parallel that their plane is known to 25 degrees only; 20 are needed"
    )
    value = stage_value(request, evaluation(90.0, 25.0), assumed=True, parameters=PARAMETERS)
    assert (value.reason, value.assumed, value.status) == (reason, True, MeasureStatus.NOT_MEASURED)
    assert plane_reason(MeasureRequest("kyphosis", None, ()), evaluation(90.0, 25.0), PARAMETERS) is None


def test_a_plane_that_noise_has_swung_to_the_axis_of_the_larger_errors_is_not_determined() -> None:
    # The errors of the sagittal tilts are three times those of the coronal ones, and so is the measured curve.
    request = MeasureRequest("plane-of-maximum-curvature", "curve 1", ("L1", "L3"))
    factor = errors(3, 0.3, 1.0) @ np.diag(np.tile([1.0, 1, 1, 1, 3, 1], 3))
    for coronal, sagittal, measured in ((0.5, 8.0, False), (8.0, 0.5, True)):
        spine = replace(
            tilted(
                [-coronal / 2, 0.0, coronal / 2],
                [sagittal / 2, 0.0, -sagittal / 2],
                levels=("L1", "L2", "L3"),
            ),
            errors={"triads A": factor},
        )
        found = evaluate(request, spine, common_factors((spine,))[0], frozenset())
        assert (plane_reason(request, found, PARAMETERS) is None) == measured
        assert (found.sd <= 20) != measured
    # The interval is as wide as the larger errors make it.
    lower, upper = interval_of(request, found)
    assert lower < 60
    assert upper > 120


def test_what_is_not_measured_has_no_number() -> None:
    value = not_measured(MeasureRequest("kyphosis", None, ("T5", "T12")), "no marker", assumed=False)
    assert np.isnan([value.value, value.sd, value.lower, value.upper]).all()
    assert value.reason == "no marker"


def test_the_reselected_angle_is_that_of_the_measured_tilts() -> None:
    before = tilted([-25.0, -20.0, 0.0, 20.0, 30.0])
    after = replace(tilted([-5.0, -12.0, 0.0, 10.0, 8.0]), errors={"triads A": errors(5, 0.3, 0.1)})
    curves = find_curves(before)
    (window,) = reselection_windows(before, curves)
    request, found = evaluate_reselected(
        curves[0], window, after, common_factors((after,))[0], frozenset(), PARAMETERS
    )
    assert request.levels == ("L2", "L4")
    assert (found.value, found.sd) == pytest.approx((22.0, 0.1 * np.sqrt(2)))
    rotation = after.poses.rotation.copy()
    rotation[:] = np.nan
    gone = replace(after, poses=SpinePoses(after.poses.position_mm, rotation))
    request, found = evaluate_reselected(
        curves[0], window, gone, common_factors((gone,))[0], frozenset(), PARAMETERS
    )
    assert (request.levels, found.status) == (("L1", "L5"), MeasureStatus.NOT_MEASURED)


def test_an_interpolated_vertebra_that_may_be_tilted_more_brackets_the_reselected_angle() -> None:
    before = tilted([-25.0, -20.0, 0.0, 20.0, 30.0])
    factor = np.zeros((5, 6, 1))
    factor[3, 3, 0] = 6.0
    origins = (*before.origins[:3], Origin.INTERPOLATED, before.origins[4])
    after = replace(
        tilted([-25.0, -20.0, 0.0, 27.0, 26.0]), errors={"interpolation A": factor}, origins=origins
    )
    rough = MeasureParameters(tilt_roughness_deg=1000.0)
    found = measure_spine(after, before, rough).measures
    value = next(m for m in found if m.definition == "cobb-reselected")
    assert (value.levels, value.status) == (("L1", "L5"), MeasureStatus.BRACKETED)
    assert value.reason == "L4 has no marker at this stage and may be tilted more"
    # L4 may have 27 + 6 degrees, 7 more than L5; the marked ends are known exactly.
    assert (value.lower, value.value, value.upper) == pytest.approx((51.0, 51.0, 58.0), abs=0.01)
