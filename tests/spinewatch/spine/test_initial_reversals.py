"""Poses that are mirrored or of another patient are seen by the triads; sound ones are not flagged."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.scoliosis import (
    LEVELS,
    CurveKind,
    MountParameters,
    ScoliosisParameters,
    SimulatedSpine,
    placed,
    prone_axes,
    random_mounts,
    random_scoliosis,
    triads_on,
)
from spinewatch.spine.configuration import SpineSetup
from spinewatch.spine.initial import InitialPlacementError, initial_from_poses
from spinewatch.spine.initial_reversals import ReversalParameters, initial_reversal_flags
from spinewatch.triads.pose import Pose

AXES = prone_axes("x")
MARKED = LEVELS[4:11]
CENTRE = np.array([400.0, 380.0, 50.0])
SIGNS = {
    "left and right exchanged": (1.0, -1.0, 1.0),
    "front and back exchanged": (-1.0, 1.0, 1.0),
    "left and right, and front and back, exchanged": (-1.0, -1.0, 1.0),
}
LARGE = ScoliosisParameters(
    cobb_deg=(35.0, 70.0), kyphosis_deg=(20.0, 35.0), lordosis_deg=(30.0, 40.0), irregularity_sd_deg=2.0
)
Frame = Literal["object", "patient"]


def spine(seed: int, parameters: ScoliosisParameters = LARGE) -> SimulatedSpine:
    return random_scoliosis(np.random.default_rng(seed), list(CurveKind)[seed % 3], parameters)


def triads(of: SimulatedSpine, seed: int, mounts: MountParameters | None = None) -> dict[str, Pose]:
    """Return the triads of a prone patient, object space."""
    clamped = random_mounts(np.random.default_rng([seed, 1]), MARKED, mounts)
    return triads_on(placed(of.poses, AXES, CENTRE), clamped)


def flags(
    given: SimulatedSpine,
    seen: dict[str, Pose],
    seed: int,
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0),
    frame: Frame = "patient",
    sd: tuple[float, float] = (2.0, 3.0),
    parameters: ReversalParameters | None = None,
) -> tuple[Flag, ...]:
    """Return the flags of poses with errors, by stated axes that err by 3 degrees."""
    rng, F = np.random.default_rng([seed, 2]), np.diag(signs)
    axes = AXES @ rotation_from_vector(np.radians(3.0) * rng.standard_normal(3))
    errors = rotation_from_vector(np.radians(3.0) * rng.standard_normal((len(LEVELS), 3)))
    position = given.poses.position_mm @ F + 2.0 * rng.standard_normal((len(LEVELS), 3))
    rotation: Float = errors @ F @ given.rotation @ F
    if frame == "object":
        position, rotation = (position - position.mean(axis=0)) @ AXES.T + CENTRE, AXES @ rotation
    initial = initial_from_poses(LEVELS, position, rotation, *sd, frame=frame, patient_axes=axes, triads=seen)
    setup = SpineSetup(axes, LEVELS[0], "PRE", initial, axes_covariance_deg2=9.0 * np.eye(3))
    return initial_reversal_flags(setup, seen, parameters)


@pytest.mark.parametrize("frame", ["object", "patient"])
@pytest.mark.parametrize("seed", range(12))
def test_sound_poses_raise_nothing(seed: int, frame: Frame) -> None:
    kyphosis = ScoliosisParameters(cobb_deg=(1.0, 15.0), kyphosis_deg=(50.0, 85.0))
    for parameters in (LARGE, ScoliosisParameters(cobb_deg=(5.0, 25.0)), kyphosis):
        own = spine(seed, parameters)
        assert flags(own, triads(own, seed), seed, frame=frame) == ()


@pytest.mark.parametrize("frame", ["object", "patient"])
@pytest.mark.parametrize("what", SIGNS)
@pytest.mark.parametrize("seed", [3, 6])
def test_reversed_poses_are_named(what: str, frame: Frame, seed: int) -> None:
    own = spine(seed)
    (flag,) = flags(own, triads(own, seed), seed, SIGNS[what], frame)
    assert flag.code == "initial-poses-reversed"
    assert f"with {what} (misfit" in flag.detail
    assert "from which side the radiographs were read" in flag.detail


def test_poses_of_another_patient_do_not_fit() -> None:
    found: list[str] = []
    for seed in range(30):
        try:
            doubts = flags(spine(seed + 100), triads(spine(seed), seed), seed)
        except InitialPlacementError:
            found.append("refused")
        else:
            found += [flag.code for flag in doubts]
    assert len(found) >= 8


def test_misfit_says_how_far() -> None:
    own = spine(1)
    seen = {
        name: Pose(
            pose.position_mm + 2 * (n % 2) * np.array([0.0, 30.0, 0.0]), pose.rotation, pose.covariance
        )
        for n, (name, pose) in enumerate(triads(own, 1).items())
    }
    (flag,) = flags(own, seen, 1)
    assert flag.code == "initial-poses-misfit"
    told = float(flag.detail.split("expect them by ")[1].split(" times")[0])
    assert 1.5 < told < 4
    assert "of this patient" in flag.detail


def test_poses_that_are_only_known_roughly_are_not_doubtful() -> None:
    own = spine(2)
    wrong = SIGNS["left and right exchanged"]
    assert flags(own, triads(own, 2), 2, wrong)
    assert flags(own, triads(own, 2), 2, wrong, sd=(100.0, 60.0)) == ()


def test_clamps_that_scatter_say_less() -> None:
    loose = MountParameters(sd_mm=14.0, tilt_sd_deg=15.0)
    for seed in range(10):
        own = spine(seed)
        found = flags(own, triads(own, seed, loose), seed)
        assert "initial-poses-reversed" not in {flag.code for flag in found}


def test_triads_that_all_lean_the_same_way_raise_nothing() -> None:
    lean = rotation_from_vector(np.radians([0.0, 0.0, 25.0]))
    for seed in range(6):
        own = spine(seed)
        seen = {
            name: Pose(pose.position_mm, lean @ pose.rotation, pose.covariance)
            for name, pose in triads(own, seed).items()
        }
        assert flags(own, seen, seed) == ()


def test_two_triads_say_nothing_and_parameters_are_used() -> None:
    own, wrong = spine(0), SIGNS["front and back exchanged"]
    two = dict(list(triads(own, 0).items())[:2])
    assert flags(own, two, 0, wrong) == ()
    seen = triads(own, 0)
    never = ReversalParameters(min_ratio=np.inf, max_misfit=np.inf)
    assert flags(own, seen, 0, wrong, parameters=never) == ()
    always = ReversalParameters(max_misfit=0.0, significance=1.0)
    assert [flag.code for flag in flags(own, seen, 0, parameters=always)] == ["initial-poses-misfit"]
