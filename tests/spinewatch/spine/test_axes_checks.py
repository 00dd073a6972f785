"""Axes that bodies, triads or angles disagree with are flagged or refused; sound ones and vague ones are not."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.spine.axes_checks import (
    AxesCheckParameters,
    AxesEvidence,
    axes_doubt,
    patient_axes_flags,
)
from spinewatch.spine.configuration import SpineSetup
from spinewatch.spine.generic_spine import generic_spine
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.triads.pose import Pose
from tests.spinewatch.spine.simulated import AXES, turn

LEVELS = tuple(f"T{i}" for i in range(4, 13))
ALONG = np.linspace(-1, 1, len(LEVELS))
CORONAL = 25 * np.sin(ALONG * np.pi / 2)
ROTATION = rotation_from_tilts(CORONAL, -15 * ALONG, -12 * np.cos(ALONG * np.pi / 2))
"""A curve of 50 degrees to the right, whose bodies turn with it."""
FACING = np.column_stack([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def centroids() -> Float:
    z = ROTATION[:, :, 2]
    steps = 25.0 * (z[:-1] + z[1:]) / 2
    return np.asarray(np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))]))


POSITION = centroids()


def triads(levels: tuple[str, ...] = LEVELS, facing: Float = FACING) -> dict[str, Pose]:
    """Return triads 45 mm behind each body, in object space of a prone patient."""
    rng = np.random.default_rng(1)
    P = POSITION + ROTATION @ [-45.0, 0, 0] + 4.0 * rng.standard_normal(POSITION.shape)
    return {
        level: Pose(AXES @ P[i], AXES @ ROTATION[i] @ facing, np.zeros((6, 6)))
        for i, level in enumerate(LEVELS)
        if level in levels
    }


def setup(
    wrong: Float,
    frame: Literal["object", "patient"] = "object",
    *,
    angles: bool = False,
    sd_deg: float = 3.0,
    levels: tuple[str, ...] = LEVELS,
) -> SpineSetup:
    """Return a setup whose axes are turned against the patient's; rotations are matrices or angles."""
    axes = AXES @ wrong
    to_frame = np.eye(3) if frame == "patient" else AXES
    rows = [LEVELS.index(level) for level in levels]
    initial = initial_from_poses(
        levels,
        POSITION[rows] @ to_frame.T,
        (axes if angles else to_frame) @ ROTATION[rows],
        2.0,
        3.0,
        frame=frame,
        patient_axes=axes,
        triads=triads(levels),
        turned_with_axes=[angles or frame == "patient"] * len(levels),
    )
    return SpineSetup(axes, "T12", "PRE", initial, axes_covariance_deg2=sd_deg**2 * np.eye(3))


def details(given: SpineSetup, seen: dict[str, Pose] | None = None) -> list[str]:
    flags = patient_axes_flags(given, triads(given.initial.levels) if seen is None else seen)
    assert {flag.code for flag in flags} <= {"patient-axes-doubtful"}
    return [flag.detail for flag in flags]


@pytest.mark.parametrize(("frame", "angles"), [("object", False), ("object", True), ("patient", False)])
@pytest.mark.parametrize("wrong", [turn(0, 0, 0), turn(4, 0, 0), turn(0, -4, 0), turn(0, 0, 5)])
def test_sound_axes_are_not_flagged(frame: Literal["object", "patient"], angles: bool, wrong: Float) -> None:
    assert details(setup(wrong, frame, angles=angles)) == []


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("frame", "angles", "x", "z", "words"),
    [
        ("object", False, 0, 18, "axial rotations of the initial poses"),
        ("object", True, 18, 0, "the line of the centroids"),
        ("patient", False, 15, 0, "the triads against the initial poses"),
    ],
)
def test_what_disagrees_is_named_with_the_angle_and_the_axis(
    frame: Literal["object", "patient"], angles: bool, x: float, z: float, words: str, sign: int
) -> None:
    (detail,) = details(setup(turn(sign * x, 0, sign * z), frame, angles=angles))
    assert words in detail
    assert ("z (cephalad)" if z else "x (anterior)") in detail
    told = float(detail.split("turned by ")[1].split(" degrees")[0])
    assert told == pytest.approx(x + z, abs=4)


@pytest.mark.parametrize(
    ("frame", "angles", "wrong"),
    [("object", False, turn(0, 0, 40)), ("object", True, turn(0, 35, 0)), ("patient", False, turn(28, 0, 0))],
)
def test_axes_that_are_far_off_are_refused_unless_they_are_said_to_be_vague(
    frame: Literal["object", "patient"], angles: bool, wrong: Float
) -> None:
    with pytest.raises(PatientAxesContradictedError, match=r"turned by \d+ degrees.*larger deviation"):
        details(setup(wrong, frame, angles=angles))
    assert not [d for d in details(setup(wrong, frame, angles=angles, sd_deg=20.0)) if "turned by" in d]


def test_the_fewer_bodies_the_less_they_say() -> None:
    wrong = turn(0, 0, 18)
    assert details(setup(wrong, levels=LEVELS[3:6])) == []
    assert len(details(setup(wrong))) == 1


def test_a_whole_spine_is_less_inclined_than_a_part() -> None:
    # 8 levels from T4 to T12: 36 degrees.
    assert details(setup(turn(0, 30, 0))) == []
    (detail,) = details(setup(turn(0, 40, 0)))
    assert "from T12 up to T4 the bodies run" in detail
    assert "more than 36" in detail
    names = (*(f"T{i}" for i in range(1, 13)), *(f"L{i}" for i in range(1, 6)))
    given = setup(turn(0, 30, 0))
    long = np.stack([np.zeros(17), np.zeros(17), 25.0 * np.arange(17)[::-1]], axis=1)
    initial = replace(
        given.initial, levels=names, position_mm=long @ AXES.T, rotation=np.tile(AXES, (17, 1, 1))
    )
    (detail,) = details(replace(given, initial=initial), {})
    assert "from L5 up to T1" in detail


def test_triads_of_a_generic_spine_run_along_cephalad_and_face_the_back() -> None:
    def generic(wrong: Float, seen: dict[str, Pose]) -> list[str]:
        axes = AXES @ wrong
        return details(SpineSetup(axes, "T12", "PRE", generic_spine(seen, axes)), seen)

    assert generic(np.eye(3), triads()) == generic(turn(0, 20, 0), triads()) == []
    assert "the triads run" in generic(turn(44, 0, 0), triads())[0]
    (detail,) = generic(np.eye(3), triads(facing=turn(0, 0, 60) @ FACING))
    # The bodies are turned the other way by 7 degrees on average.
    assert "the triads face 53 degrees from the posterior direction" in detail


def test_without_triads_poses_in_object_axes_still_say_something() -> None:
    assert len(details(setup(turn(0, 0, 18)), {})) == 1


def test_information_on_nothing_flags_nothing() -> None:
    evidence = AxesEvidence("nothing shows", np.full(3, 40.0), np.zeros((3, 3)))
    assert axes_doubt(evidence, np.zeros((3, 3))) is None


def test_small_rotations_are_not_doubtful_however_exact_the_axes() -> None:
    limit = AxesCheckParameters().min_angle_deg
    for angle, doubted in ((limit - 1, False), (limit + 1, True)):
        evidence = AxesEvidence("the films show", np.array([0.0, angle, 0.0]), np.eye(3))
        assert (axes_doubt(evidence, np.zeros((3, 3))) is not None) == doubted
