from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.curves import find_curves
from spinewatch.spine.evaluation import (
    Evaluation,
    MeasureRequest,
    bracketed_levels,
    curve_requests,
    evaluate,
    missing_reason,
    no_marker,
    spine_requests,
)
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.uncertainty import common_factors
from tests.spinewatch.spine.spines import errors, scoliosis, tilted

COBB = MeasureRequest("cobb-fixed", "curve 1", ("L1", "L5"))


def spine(rotation_sd_deg: float = 1.0) -> SpineConfiguration:
    return replace(
        tilted([-20.0, -10.0, 0.0, 10.0, 20.0]), errors={"triads A": errors(5, 0.4, rotation_sd_deg)}
    )


def found(request: MeasureRequest, at: SpineConfiguration) -> Evaluation:
    return evaluate(request, at, common_factors((at,))[0], bracketed_levels(at))


def test_the_variance_of_a_cobb_angle_is_the_sum_of_those_of_the_tilts() -> None:
    cobb = found(COBB, spine())
    assert cobb.value == pytest.approx(40.0)
    assert cobb.status is MeasureStatus.MEASURED
    assert cobb.reason is None
    assert cobb.sd == pytest.approx(np.sqrt(2.0))


def test_the_variance_of_a_length() -> None:
    balance = found(MeasureRequest("coronal-balance", None, ("L1", "L5")), spine())
    assert balance.sd == pytest.approx(0.4 * np.sqrt(2.0))


def test_the_3d_angle_has_a_deviation_without_a_curve() -> None:
    at = replace(tilted([0.0, 0.0, 0.0]), errors={"triads A": errors(3)})
    angle = found(MeasureRequest("angle-3d", "curve 1", ("L3", "L5")), at)
    assert (angle.value, angle.sd) == pytest.approx((0.0, np.sqrt(2.0)))
    assert angle.vector is not None
    assert angle.vector.covariance == pytest.approx(2 * np.eye(2))
    without_errors = found(MeasureRequest("angle-3d", "curve 1", ("L3", "L5")), tilted([0.0, 0.0, 0.0]))
    assert without_errors.sd == 0.0
    assert without_errors.vector is not None
    assert not without_errors.vector.covariance.any()
    bent = found(MeasureRequest("angle-3d", "curve 1", ("L1", "L5")), spine(1.5))
    assert (bent.value, bent.sd) == pytest.approx((40.0, 1.5 * np.sqrt(2.0)))


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_vectors_agree_with_the_values_and_their_errors(seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = [tilted(*rng.uniform(-30, 30, (3, 5))).poses for _ in range(2)]
    at = replace(
        spine(),
        poses=poses[0],
        alternatives=(poses[1],),
        origins=(Origin.INTERPOLATED,) * 5,
        errors={"triads A": rng.normal(size=(5, 6, 9))},
    )
    ends = ("L1", "L5")
    angle, plane = (
        found(MeasureRequest(name, "curve 1", ends), at)
        for name in ("angle-3d", "plane-of-maximum-curvature")
    )
    assert angle.vector is not None
    assert plane.vector is not None
    assert np.linalg.norm(angle.vector.values, axis=1) == pytest.approx(angle.values)
    directions = np.degrees(np.arctan2(plane.vector.values[:, 1], plane.vector.values[:, 0]))
    assert wrapped(directions - plane.values) == pytest.approx(np.zeros(2), abs=1e-9)
    for measure, across in ((angle, False), (plane, True)):
        assert measure.vector is not None
        d = measure.vector.values[0]
        unit = np.array([-d[1], d[0]]) if across else d
        sd = np.sqrt(unit @ measure.vector.covariance @ unit) / np.linalg.norm(d)
        assert measure.sd == pytest.approx(np.degrees(sd / np.linalg.norm(d)) if across else sd, rel=1e-4)


def test_only_two_measures_have_a_vector() -> None:
    assert found(COBB, spine()).vector is None
    assert found(MeasureRequest("angle-3d", None, ("L1", "S1")), spine()).vector is None


def test_an_interpolated_vertebra_brackets_with_the_other_interpolations() -> None:
    at = spine()
    other = tilted([-26.0, -10.0, 0.0, 10.0, 20.0]).poses
    at = replace(at, origins=(Origin.INTERPOLATED, *at.origins[1:]), alternatives=(other,))
    cobb = found(COBB, at)
    assert cobb.status is MeasureStatus.BRACKETED
    assert cobb.values == pytest.approx([40.0, 46.0])
    assert cobb.reason == "L1 has no marker at this stage"
    assert bracketed_levels(at) == {"L1"}


def test_an_assumed_vertebra_without_a_marker_is_bracketed_whatever_interpolations_say() -> None:
    at = spine()
    other = tilted([-26.0, -10.0, 0.0, 10.0, 20.0]).poses
    assumed = replace(
        at, origins=(Origin.ASSUMED,) * 5, marked=(False, True, True, True, True), alternatives=(other,)
    )
    assert bracketed_levels(assumed) == {"L1"}
    assert bracketed_levels(replace(assumed, alternatives=(at.poses,))) == {"L1"}
    assert bracketed_levels(replace(assumed, alternatives=())) == {"L1"}
    assert bracketed_levels(replace(assumed, marked=(True,) * 5)) == frozenset()


def test_a_missing_pose_is_a_reason() -> None:
    at = spine()
    rotation = at.poses.rotation.copy()
    rotation[4] = np.nan
    at = replace(
        at, poses=SpinePoses(at.poses.position_mm, rotation), reasons=(None,) * 4 + ("it is hidden",)
    )
    cobb = found(COBB, at)
    assert cobb.status is MeasureStatus.NOT_MEASURED
    assert np.isnan(cobb.value)
    assert cobb.reason == "L5 was not measured: it is hidden"
    assert found(MeasureRequest("coronal-balance", None, ("L1", "L5")), at).status is MeasureStatus.MEASURED
    assert missing_reason(at, ("S1",)) == "the configuration of the spine has no S1"
    assert missing_reason(at, ("L1", "L5"), rotations=False) is None


def test_reasons_have_a_number() -> None:
    assert no_marker(["T5", "T12"]) == "T5 and T12 have no marker at this stage"


def test_what_is_measured_of_a_curve_and_of_the_spine() -> None:
    curve = find_curves(scoliosis())[1]
    by_definition = {request.definition: request.levels for request in curve_requests(curve)}
    assert by_definition["cobb-fixed"] == by_definition["angle-3d"] == ("T5", "T12")
    assert by_definition["ferguson"] == ("T5", curve.apex, "T12")
    assert by_definition["apical-rotation"] == (curve.apex,)
    whole = [(r.definition, r.levels) for r in spine_requests(scoliosis(), MeasureParameters())]
    assert whole == [
        ("kyphosis", ("T5", "T12")),
        ("kyphosis", ("T2", "T12")),
        ("kyphosis", ("T10", "L2")),
        ("lordosis", ("L1", "L5")),
        ("coronal-balance", ("T1", "L5")),
    ]
    short = [(r.definition, r.levels) for r in spine_requests(spine(), MeasureParameters())]
    assert short == [
        ("kyphosis", ("T5", "T12")),
        ("lordosis", ("L1", "L5")),
        ("coronal-balance", ("L1", "L5")),
    ]


def test_a_displacement_has_the_error_of_the_reference_vertebra_too() -> None:
    request = MeasureRequest("apical-translation", "curve 1", ("L1",))
    alone, line = (found(request, replace(spine(), reference=name)) for name in (None, "L3"))
    y = spine().poses.position_mm[:, 1]
    assert (alone.value, alone.sd) == pytest.approx((-y[0], 0.4))
    assert (line.value, line.sd) == pytest.approx((y[2] - y[0], 0.4 * np.sqrt(2)))
    own = found(request, replace(spine(), reference="L1"))
    assert own.status is MeasureStatus.NOT_MEASURED
    assert own.reason == "L1 is the reference vertebra, which it is measured from"
    assert found(request, replace(spine(), reference="S1")).value == pytest.approx(-y[0])
