from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.scoliosis import (
    BODY_HEIGHT_MM,
    DISC_HEIGHT_MM,
    LEVELS,
    CurveKind,
    Manoeuvre,
    ScoliosisParameters,
    SimulatedSpine,
    corrected,
    mirrored,
    moved_cart,
    placed,
    prone_axes,
    random_mounts,
    random_scoliosis,
    triads_on,
)
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.orientation import tilts_of

seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from(list(CurveKind))
N = len(LEVELS)
FIXED = ScoliosisParameters(cobb_deg=(60.0, 60.0), greatest_step_deg=90.0)


def straight() -> SimulatedSpine:
    return SimulatedSpine(np.stack([np.eye(3)] * N), BODY_HEIGHT_MM, DISC_HEIGHT_MM, (4.0, 10.0))


def spine_extremes_order(coronal: Float, ends: tuple[float, ...]) -> Float:
    """Positive where the tilt of an end is a maximum, from its neighbours among the ends."""
    tilts = np.interp(ends, np.arange(N), coronal)
    steps = -np.diff(tilts)
    return np.append(steps, -steps[-1])


def test_levels_have_heights() -> None:
    assert LEVELS[0] == "T1"
    assert LEVELS[11:13] == ("T12", "L1")
    assert len(LEVELS) == len(BODY_HEIGHT_MM) == len(DISC_HEIGHT_MM) + 1 == 17


def test_a_straight_spine_is_as_long_as_its_bodies_and_discs() -> None:
    centroids = straight().poses.position_mm
    assert np.all(centroids[:, :2] == 0)
    assert centroids[-1, 2] == 0
    assert centroids[0, 2] == pytest.approx(BODY_HEIGHT_MM.sum() + DISC_HEIGHT_MM.sum() - (14.1 + 22.9) / 2)
    assert centroids[-2, 2] == pytest.approx(22.9 / 2 + 11.0 + 24.1 / 2)


@settings(max_examples=40)
@given(seeds, kinds)
def test_tilts_are_extreme_at_the_ends_and_differ_by_the_cobb_angle(seed: int, kind: CurveKind) -> None:
    spine = random_scoliosis(np.random.default_rng(seed), kind, FIXED)
    coronal, _, axial = tilts_of(spine.rotation)
    near = [coronal[int(end) : int(end) + 2] for end in spine.ends]
    signs = np.sign(spine_extremes_order(coronal, spine.ends))
    extremes = [values[np.argmax(sign * values)] for values, sign in zip(near, signs, strict=True)]
    for a, b in pairwise(extremes):
        assert 50 < abs(b - a) <= 60 + 1e-9
    assert coronal.max() == pytest.approx(max(extremes))
    assert coronal.min() == pytest.approx(min(extremes))
    apex = round((spine.ends[0] + spine.ends[1]) / 2)
    # The anterior side turns towards the convex side: to the right, negative, where the Cobb angle is positive.
    assert axial[apex] * (extremes[1] - extremes[0]) < 0


@settings(max_examples=20)
@given(seeds, kinds)
def test_a_curve_is_convex_to_the_right_where_the_lower_end_tilts_up_on_the_left(
    seed: int, kind: CurveKind
) -> None:
    spine = random_scoliosis(np.random.default_rng(seed), kind)
    coronal, _, _ = tilts_of(spine.rotation)
    upper, lower = (round(end) for end in spine.ends[:2])
    y = spine.poses.position_mm[:, 1]
    z = spine.poses.position_mm[:, 2]
    apex = round((upper + lower) / 2)
    line = np.interp(z[apex], [z[lower], z[upper]], [y[lower], y[upper]])
    to_the_right = -(y[apex] - line)
    assert to_the_right * (coronal[lower] - coronal[upper]) > 0


def test_short_curves_are_small() -> None:
    limited = ScoliosisParameters(cobb_deg=(10.0, 90.0), greatest_step_deg=5.0)
    for seed in range(20):
        spine = random_scoliosis(np.random.default_rng(seed), CurveKind.LUMBAR, limited)
        coronal, _, _ = tilts_of(spine.rotation)
        assert np.ptp(coronal) <= 5 * (spine.ends[1] - spine.ends[0]) + 1e-9


def test_kyphosis_and_lordosis_are_in_their_ranges() -> None:
    for seed in range(20):
        spine = random_scoliosis(np.random.default_rng(seed), CurveKind.THORACIC)
        _, sagittal, _ = tilts_of(spine.rotation)
        assert 15 <= sagittal[0] - sagittal[12] <= 45
        assert 30 <= sagittal[16] - sagittal[12] <= 55


def test_irregularity_has_its_deviation() -> None:
    smooth, rough = (
        np.stack(
            [
                tilts_of(
                    random_scoliosis(
                        np.random.default_rng(seed),
                        CurveKind.LUMBAR,
                        ScoliosisParameters(irregularity_sd_deg=sd),
                    ).rotation
                )[0]
                for seed in range(100)
            ]
        )
        for sd in (0.0, 2.0)
    )
    assert (rough - smooth).std() == pytest.approx(2.0, rel=0.1)


def test_straightening_and_derotation_remove_their_shares() -> None:
    spine = random_scoliosis(np.random.default_rng(1), CurveKind.DOUBLE)
    before = tilts_of(spine.rotation)
    after = tilts_of(corrected(spine, Manoeuvre(straightening=0.25, derotation=0.5)).rotation)
    tangents = np.tan(np.radians(before[0])), np.tan(np.radians(after[0]))
    assert tangents[1] == pytest.approx(0.75 * tangents[0])
    assert after[1] == pytest.approx(before[1])
    assert after[2] == pytest.approx(0.5 * before[2])


def test_distraction_opens_the_discs_between_the_ends_only() -> None:
    spine = straight()
    after = corrected(spine, Manoeuvre(distraction_mm=12.0))
    opened = after.disc_mm - spine.disc_mm
    assert opened[4:10] == pytest.approx(2.0)
    assert opened[:4] == pytest.approx(0.0)
    assert opened[10:] == pytest.approx(0.0)
    assert after.poses.position_mm[0, 2] - spine.poses.position_mm[0, 2] == pytest.approx(12.0)


def test_rod_rotation_turns_the_plane_of_the_curve() -> None:
    spine = SimulatedSpine(
        np.stack([rotation_from_vector(np.radians([30.0, 0.0, 0.0]))] * N),
        BODY_HEIGHT_MM,
        DISC_HEIGHT_MM,
        (4.0, 10.0),
    )
    after = corrected(spine, Manoeuvre(rod_rotation_deg=90.0, twist_share=0.1, margin_levels=2.0))
    coronal, sagittal, axial = tilts_of(spine.rotation)
    turned = tilts_of(after.rotation)
    assert (coronal[7], sagittal[7], axial[7]) == pytest.approx((30, 0, 0))
    # The axis leans to the right; a quarter turn to the left brings it from right (-Y) to the front (X).
    assert [angle[7] for angle in turned] == pytest.approx([0, 30, 9])
    outside = [0, 1, 2, 12, 13, 16]
    assert after.rotation[outside] == pytest.approx(spine.rotation[outside])
    assert turned[1][4] > 1


def test_irregular_rotations_need_a_source() -> None:
    spine, rough = straight(), Manoeuvre(irregularity_sd_deg=3.0)
    assert corrected(spine, rough).rotation == pytest.approx(spine.rotation)
    turned = corrected(spine, rough, np.random.default_rng(0)).rotation
    assert np.std(tilts_of(turned)) == pytest.approx(3.0, rel=0.3)


@given(seeds, kinds)
def test_mirror_changes_the_sides_only(seed: int, kind: CurveKind) -> None:
    spine = random_scoliosis(np.random.default_rng(seed), kind)
    other = mirrored(spine)
    assert np.linalg.det(other.rotation) == pytest.approx(1.0)
    before, after = tilts_of(spine.rotation), tilts_of(other.rotation)
    assert after[0] == pytest.approx(-before[0])
    assert after[1] == pytest.approx(before[1])
    assert after[2] == pytest.approx(-before[2])
    assert other.poses.position_mm == pytest.approx(spine.poses.position_mm * [1, -1, 1])


@pytest.mark.parametrize("head_first", [True, False])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_prone_patient_lies_with_the_back_to_the_cameras(axis: str, head_first: bool) -> None:
    axes = prone_axes("x" if axis == "x" else "y", head_first=head_first)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert list(axes[:, 0]) == [0, 0, -1]
    assert axes["xy".index(axis), 2] == (1 if head_first else -1)


def test_left_of_a_prone_patient() -> None:
    # Face down with the head towards +X and seen from above, the left side is towards +Y.
    assert list(prone_axes("x")[:, 1]) == [0, 1, 0]


def test_placed_spine_has_its_mean_at_the_centre() -> None:
    poses = placed(straight().poses, prone_axes("x"), np.array([1.0, 2.0, 3.0]))
    assert poses.position_mm.mean(axis=0) == pytest.approx([1, 2, 3])
    assert np.all(np.diff(poses.position_mm[:, 0]) < 0)
    assert poses.rotation[0] == pytest.approx(prone_axes("x"))


def test_moved_cart_turns_about_a_point() -> None:
    quarter = rotation_from_vector(np.array([0.0, 0.0, np.pi / 2]))
    poses = SpinePoses(np.array([[1.0, 0.0, 0.0]]), np.eye(3)[None])
    moved = moved_cart(poses, quarter, np.array([0.0, 0.0, 5.0]), np.zeros(3))
    assert moved.position_mm[0] == pytest.approx([0, 1, 5])
    assert moved.rotation[0] == pytest.approx(quarter)


def test_markers_are_fixed_behind_their_bodies_and_face_the_cameras() -> None:
    rng = np.random.default_rng(0)
    mounts = random_mounts(rng, ("T5", "L1"))
    spine = placed(straight().poses, prone_axes("x"), np.zeros(3))
    turn = rotation_from_vector(np.array([0.1, 0.3, -0.2]))
    before = triads_on(spine, mounts)
    after = triads_on(moved_cart(spine, turn, np.array([1.0, 2.0, 3.0]), np.zeros(3)), mounts)
    assert list(before) == ["T5", "L1"]
    for level, pose in before.items():
        body = spine.position_mm[LEVELS.index(level)]
        assert pose.position_mm[2] - body[2] == pytest.approx(45, abs=20)
        assert pose.normal[2] > 0.8
        assert after[level].rotation == pytest.approx(turn @ pose.rotation)
        assert after[level].position_mm == pytest.approx(turn @ pose.position_mm + [1, 2, 3])
        assert not pose.covariance.any()


def test_mounts_have_any_azimuth() -> None:
    rng = np.random.default_rng(0)
    directions = np.stack([random_mounts(rng, ("T5",))["T5"].rotation[1:, 0] for _ in range(400)])
    azimuth = np.arctan2(directions[:, 0], directions[:, 1])
    counts, _ = np.histogram(azimuth, bins=4, range=(-np.pi, np.pi))
    assert counts.min() > 60
