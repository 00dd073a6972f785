from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.levels import LevelError
from spinewatch.simulation.scoliosis import (
    LEVELS,
    CurveKind,
    placed,
    random_mounts,
    random_scoliosis,
    triads_on,
)
from spinewatch.spine.configuration import InitialKind, SpinePoses
from spinewatch.spine.generic_spine import GENERIC_SPINE, NoTriadsError, generic_spine
from spinewatch.spine.orientation import tilts_of
from spinewatch.triads.pose import Pose
from tests.spinewatch.spine.simulated import AXES, moved, poses_of, turn

KINDS = list(CurveKind)


def scoliosis(seed: int, marked: tuple[str, ...] = LEVELS) -> tuple[SpinePoses, dict[str, Pose]]:
    rng = np.random.default_rng(seed)
    spine = random_scoliosis(rng, KINDS[seed % 3])
    poses = placed(spine.poses, AXES, np.array([0.0, 0, 900]))
    return poses, triads_on(poses, random_mounts(rng, marked))


def test_its_kyphosis_lordosis_and_length_are_the_published_ones() -> None:
    # One triad says where the spine is and nothing of its shape.
    spine = generic_spine({"T12": poses_of(np.zeros(3), np.eye(3))}, np.eye(3))
    _, sagittal, axial = tilts_of(spine.rotation)
    at = {name: float(sagittal[i]) for i, name in enumerate(spine.levels)}
    # z is along the curve: end values are those of the chords.
    assert at["T1"] - at["T12"] == pytest.approx(GENERIC_SPINE.kyphosis_deg, abs=2.5)
    assert at["L5"] - at["T12"] == pytest.approx(GENERIC_SPINE.lordosis_deg, abs=5)
    assert np.allclose(axial, 0, atol=1e-9)
    length = np.linalg.norm(np.diff(spine.position_mm, axis=0), axis=1).sum()
    bodies = [GENERIC_SPINE.body_height_mm[name] for name in spine.levels]
    discs = [GENERIC_SPINE.disc_height_mm[name] for name in spine.levels[:-1]]
    assert length == pytest.approx(sum(bodies) - (bodies[0] + bodies[-1]) / 2 + sum(discs), rel=0.01)
    # The body is 45 mm before its triad, along its own x axis.
    i = spine.levels.index("T12")
    assert np.allclose(spine.position_mm[i], 45 * spine.rotation[i, :, 0], atol=1.0)


def test_errors_cover_what_is_not_known_of_scoliotic_spines() -> None:
    for marked in (LEVELS, LEVELS[::3], ("T7", "T9", "T11", "L1")):
        inside, count = np.zeros(6), 0
        for seed in range(30):
            truth, triads = scoliosis(seed, marked)
            spine = generic_spine(triads, AXES)
            to_patient = np.kron(np.eye(2), AXES.T)
            F = to_patient @ spine.errors
            sd = np.sqrt((F**2).sum(axis=2))
            tilts = np.stack(tilts_of(AXES.T @ spine.rotation)) - np.stack(tilts_of(AXES.T @ truth.rotation))
            error = np.concatenate([(spine.position_mm - truth.position_mm) @ AXES, tilts.T], axis=1)
            inside += (np.abs(error) < 1.96 * sd).sum(axis=0)
            count += len(error)
        assert (inside / count > 0.93).all()
        assert sd.max() < 60


def test_errors_of_the_curve_tilt_the_bodies_and_axial_rotation_swings_them_by_hand() -> None:
    spine = generic_spine({"T12": poses_of(np.zeros(3), np.eye(3))}, np.eye(3))
    n = len(spine.levels)
    # The triad stays where it is: a body that turns its front to the left moves to the left of it.
    swing = spine.errors[:, :, 3 * n : 4 * n]
    assert np.allclose(swing[:, 1], 45 * np.radians(swing[:, 5]))
    assert np.allclose((swing[:, 5] ** 2).sum(axis=1), GENERIC_SPINE.axial_sd_deg**2)
    # z follows the curve when its centroids are displaced, to the left or to the front.
    z = spine.rotation[:, :, 2]
    for column in (2, 10, n + 2, n + 10):
        error = 1e-3 * spine.errors[:, :, column]
        along = -np.gradient(spine.position_mm + error[:, :3], axis=0)
        change = along / np.linalg.norm(along, axis=1, keepdims=True) - z
        predicted = np.cross(np.radians(error[:, 3:]), z)
        norms = np.linalg.norm(change) * np.linalg.norm(predicted)
        if norms > 1e-12:
            assert np.sum(change * predicted) > 0.9 * norms


def test_it_is_generic_and_rigid() -> None:
    _, triads = scoliosis(1)
    spine = generic_spine(triads, AXES)
    assert spine.kind is InitialKind.GENERIC
    assert np.allclose(np.swapaxes(spine.rotation, -1, -2) @ spine.rotation, np.eye(3))
    assert np.allclose(np.linalg.det(spine.rotation), 1)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 10**6))
def test_it_turns_with_the_rig(seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, triads = scoliosis(seed, ("T7", "T9", "T11", "L1"))
    R, t = turn(*rng.uniform(-10, 10, 3)), rng.uniform(-100, 100, 3)
    here = generic_spine(triads, AXES)
    there = generic_spine({name: moved(pose, R, t) for name, pose in triads.items()}, R @ AXES)
    assert np.allclose(there.position_mm, here.position_mm @ R.T + t, atol=1e-8)
    assert np.allclose(there.rotation, R @ here.rotation, atol=1e-10)


def test_the_order_of_the_triads_changes_nothing() -> None:
    _, triads = scoliosis(2, ("T7", "T9", "T11", "L1"))
    back = dict(reversed(triads.items()))
    assert np.allclose(
        generic_spine(triads, AXES).position_mm, generic_spine(back, AXES).position_mm, atol=1e-8
    )


def test_triads_beyond_its_ends_extend_it() -> None:
    _, triads = scoliosis(3, ("T7", "L1"))
    triads["S1"] = poses_of(triads["L1"].position_mm + np.array([150.0, 0, 0]), np.eye(3))
    assert generic_spine(triads, AXES, "T5", "L3").levels == (
        *(f"T{i}" for i in range(5, 13)),
        *(f"L{i}" for i in range(1, 6)),
        "S1",
    )
    assert "T13" in generic_spine(triads, AXES, extra_levels=["T13"]).levels


def test_a_larger_deviation_of_the_offsets_makes_a_smoother_curve() -> None:
    _, triads = scoliosis(4)
    bends = []
    for sd in (1.0, 30.0):
        spine = generic_spine(triads, AXES, parameters=replace(GENERIC_SPINE, triad_offset_sd_mm=sd))
        bends.append(np.abs(np.diff(spine.position_mm, 3, axis=0)).mean())
    assert bends[1] < bends[0]


def test_what_cannot_be_fitted_is_refused() -> None:
    with pytest.raises(NoTriadsError, match="needs a triad"):
        generic_spine({}, AXES)
    triad = {"T9": poses_of(np.zeros(3), np.eye(3))}
    with pytest.raises(LevelError, match="L5 is not above T1"):
        generic_spine(triad, AXES, "L5", "T1")
    with pytest.raises(LevelError, match="T13 is not a vertebra"):
        generic_spine(triad, AXES, "T13")
