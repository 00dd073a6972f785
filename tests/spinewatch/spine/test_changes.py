from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.changes import LevelsDifferError, vertebra_changes
from spinewatch.spine.configuration import ErrorFactors, Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.spine.results import VertebraChange
from tests.spinewatch.spine.simulated import turn

seeds = st.integers(0, 10**6)
LEVELS = ("T11", "T12", "L1", "L2")
STRAIGHT = np.outer([60.0, 30, 0, -30], [0, 0, 1])
COMPONENTS = (
    ("translation_mm", "translation_sd_mm"),
    ("rotation_vector_deg", "rotation_sd_deg"),
    ("angle_deg", "angle_sd_deg"),
    ("derotation_deg", "derotation_sd_deg"),
    ("coronal_deg", "coronal_sd_deg"),
    ("sagittal_deg", "sagittal_sd_deg"),
    ("distraction_mm", "distraction_sd_mm"),
)


def configuration(
    position: Float, rotation: Float, errors: ErrorFactors | None = None, origin: Origin = Origin.MEASURED
) -> SpineConfiguration:
    n = len(position)
    return SpineConfiguration(
        LEVELS, (True,) * n, (origin,) * n, (None,) * n, SpinePoses(position, rotation), errors or {}
    )


def changes_of(before: SpineConfiguration, after: SpineConfiguration) -> dict[str, VertebraChange]:
    return {change.vertebra: change for change in vertebra_changes(before, after, "L1")}


def still(rotation: Float | None = None) -> SpineConfiguration:
    return configuration(STRAIGHT, np.stack([np.eye(3)] * 4) if rotation is None else rotation)


def test_a_known_rotation_and_translation_by_hand() -> None:
    R = np.stack([np.eye(3)] * 4)
    R[0] = turn(20, 0, 0)
    position = STRAIGHT.copy()
    position[0] += [3.0, -4, 0]
    change = changes_of(still(), configuration(position, R))["T11"]
    assert np.allclose(change.translation_mm, [3, -4, 0])
    assert np.allclose(change.rotation_vector_deg, [20, 0, 0])
    assert np.allclose(change.rotation, turn(20, 0, 0))
    assert change.angle_deg == pytest.approx(20)
    assert change.coronal_deg == pytest.approx(20)
    assert change.sagittal_deg == pytest.approx(0)
    assert change.derotation_deg == pytest.approx(0)
    # The chord to T12 grows from 30 to sqrt(30^2 + 5^2).
    assert change.distraction_mm == pytest.approx(np.sqrt(925) - 30)


def test_derotation_is_about_the_vertebras_own_axis() -> None:
    tilted = turn(30, 0, 0)
    before = np.stack([tilted] * 4)
    after = before.copy()
    after[0] = tilted @ turn(0, 0, 15)
    change = changes_of(still(before), still(after))["T11"]
    assert change.derotation_deg == pytest.approx(15)
    assert change.coronal_deg == pytest.approx(0, abs=1e-9)
    assert change.rotation_vector_deg == pytest.approx(15 * tilted[:, 2])


def test_distraction_sums_chords_from_the_reference_both_ways() -> None:
    position = STRAIGHT.copy()
    position[:, 2] = [66, 32, 0, -27]
    changes = changes_of(still(), configuration(position, np.stack([np.eye(3)] * 4)))
    assert [changes[name].distraction_mm for name in LEVELS] == pytest.approx([6, 2, 0, -3])


def test_distraction_skips_levels_that_one_stage_does_not_have() -> None:
    position, R = STRAIGHT.copy(), np.stack([np.eye(3)] * 4)
    position[0, 2], position[1], R[1] = 70, np.nan, np.nan
    changes = changes_of(still(), configuration(position, R))
    assert changes["T11"].distraction_mm == pytest.approx(10)
    assert np.isnan(changes["T12"].distraction_mm)


def test_without_the_reference_there_is_no_distraction() -> None:
    (change, *_) = vertebra_changes(still(), still(), "S1")
    assert np.isnan(change.distraction_mm)
    assert np.isnan(change.distraction_sd_mm)
    assert change.translation_mm == pytest.approx([0, 0, 0])


def test_what_a_stage_does_not_have_has_a_reason() -> None:
    position, R = STRAIGHT.copy(), np.stack([np.eye(3)] * 4)
    position[1], R[1] = np.nan, np.nan
    after = replace(
        configuration(position, R),
        origins=(Origin.INTERPOLATED, Origin.NOT_MEASURED, Origin.MEASURED, Origin.ASSUMED),
        reasons=(None, "it carries no triad", None, None),
    )
    changes = changes_of(still(), after)
    assert changes["T12"].reason == "it carries no triad"
    assert np.isnan(changes["T12"].translation_mm).all()
    assert np.isnan(changes["T12"].angle_sd_deg)
    assert [changes[name].origin.value for name in LEVELS] == [
        "interpolated",
        "not_measured",
        "measured",
        "assumed",
    ]
    back = changes_of(after, still())
    assert back["T12"].reason == "it carries no triad"
    assert back["T11"].origin is Origin.INTERPOLATED


def test_configurations_of_other_vertebrae_are_refused() -> None:
    with pytest.raises(LevelsDifferError, match="different vertebrae"):
        vertebra_changes(still(), replace(still(), levels=("T10", "T11", "T12", "L1")), "L1")


def test_shared_errors_cancel_and_others_add_by_hand() -> None:
    shared, own = np.zeros((4, 6, 1)), np.zeros((4, 6, 1))
    shared[0, :, 0] = 5.0
    own[0, :, 0] = 3.0
    R = np.stack([np.eye(3)] * 4)
    before = configuration(STRAIGHT, R, {"initial": shared, "triads PRE": own})
    after = configuration(STRAIGHT, R, {"initial": shared, "triads POST": own})
    change = changes_of(before, after)["T11"]
    assert np.allclose(change.translation_sd_mm, np.sqrt(18))
    assert np.allclose(change.rotation_sd_deg, np.sqrt(18))
    assert change.coronal_sd_deg == pytest.approx(np.sqrt(18))
    assert change.derotation_sd_deg == pytest.approx(np.sqrt(18))
    # Along the curve only z counts; about no axis, the largest error does: that of (1, 1, 1).
    assert change.distraction_sd_mm == pytest.approx(np.sqrt(18))
    assert change.angle_sd_deg == pytest.approx(np.sqrt(3 * 18))
    assert changes_of(before, after)["T12"].translation_sd_mm == pytest.approx(np.zeros(3))


def test_the_angle_has_an_interval_that_is_never_negative() -> None:
    errors = np.zeros((4, 6, 3))
    errors[:, 3:] = np.eye(3)
    R = np.stack([np.eye(3)] * 4)
    before = configuration(STRAIGHT, R)
    for angle, ends in ((0.0, (0.0, 1.96)), (20.0, (17.99, 21.93))):
        after = configuration(STRAIGHT, np.stack([turn(0, angle, 0)] * 4), {"triads POST": errors})
        change = changes_of(before, after)["T11"]
        assert (change.angle_lower_deg, change.angle_upper_deg) == pytest.approx(ends, abs=0.02)


def test_the_reference_has_no_motion_and_says_why() -> None:
    changes = changes_of(still(), still())
    assert changes["L1"].reason == "it is the reference vertebra, which the frame is fixed to"
    assert changes["T11"].reason is None


def disturbed(c: SpineConfiguration, unit: dict[str, Float], step: float) -> SpineConfiguration:
    error = step * np.sum([factor @ unit[source] for source, factor in c.errors.items()], axis=0)
    return replace(
        c,
        poses=SpinePoses(
            c.poses.position_mm + error[:, :3],
            rotation_from_vector(np.radians(error[:, 3:])) @ c.poses.rotation,
        ),
    )


@settings(deadline=None, max_examples=15)
@given(seeds)
def test_deviations_are_those_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sources = ("initial", "triads PRE"), ("initial", "triads PRE", "triads POST")
    before, after = (
        configuration(
            STRAIGHT + rng.normal(0, 6, (4, 3)),
            rotation_from_vector(np.radians(rng.normal(0, 15, (4, 3)))),
            {source: rng.normal(0, 1, (4, 6, 3)) for source in names},
        )
        for names in sources
    )
    changes = changes_of(before, after)
    variance = {
        (name, sd): np.zeros_like(getattr(changes["T11"], sd)) for name in LEVELS for _, sd in COMPONENTS
    }
    step = 1e-4
    for source in sources[1]:
        for column in range(3):
            unit = {s: np.eye(3)[column] * (s == source) for s in sources[1]}
            ahead, back = (
                changes_of(disturbed(before, unit, s), disturbed(after, unit, s)) for s in (step, -step)
            )
            for name in LEVELS:
                for value, sd in COMPONENTS:
                    derivative = (getattr(ahead[name], value) - getattr(back[name], value)) / (2 * step)
                    variance[name, sd] = variance[name, sd] + derivative**2
    for (name, sd), expected in variance.items():
        assert getattr(changes[name], sd) == pytest.approx(np.sqrt(expected), rel=1e-3, abs=1e-4)


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_the_way_back_is_the_opposite_and_a_mirror_flips_the_sides(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def stage() -> SpineConfiguration:
        return configuration(
            STRAIGHT + rng.normal(0, 6, (4, 3)), rotation_from_tilts(*rng.uniform(-25, 25, (3, 4)))
        )

    def mirrored(c: SpineConfiguration) -> SpineConfiguration:
        flip = np.diag([1.0, -1, 1])
        return replace(c, poses=SpinePoses(c.poses.position_mm @ flip, flip @ c.poses.rotation @ flip))

    before, after = stage(), stage()
    there, back = changes_of(before, after), changes_of(after, before)
    mirror = changes_of(mirrored(before), mirrored(after))
    for name in LEVELS:
        a, b, m = there[name], back[name], mirror[name]
        assert np.allclose(a.translation_mm, -b.translation_mm)
        assert np.allclose(a.rotation_vector_deg, -b.rotation_vector_deg)
        for component in ("derotation_deg", "coronal_deg", "sagittal_deg", "distraction_mm"):
            assert getattr(a, component) == pytest.approx(-getattr(b, component), abs=1e-9)
        assert np.allclose(m.translation_mm, a.translation_mm * [1, -1, 1])
        assert np.allclose(m.rotation_vector_deg, a.rotation_vector_deg * [-1, 1, -1])
        assert m.derotation_deg == pytest.approx(-a.derotation_deg)
        assert m.coronal_deg == pytest.approx(-a.coronal_deg)
        assert m.sagittal_deg == pytest.approx(a.sagittal_deg)
        assert m.distraction_mm == pytest.approx(a.distraction_mm)


def test_changes_of_tilt_are_wrapped() -> None:
    before, after = np.stack([turn(170, 0, 0)] * 4), np.stack([turn(-170, 0, 0)] * 4)
    assert changes_of(still(before), still(after))["T11"].coronal_deg == pytest.approx(20)
    half = np.stack([turn(180, 0, 0)] * 4)
    assert changes_of(still(np.stack([np.eye(3)] * 4)), still(half))["T11"].coronal_deg == 180
