from __future__ import annotations

import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.body_motion import body_motion
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.configuration import InitialKind, Origin, Rebaseline
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.stage_spine import spine_at_stage
from tests.spinewatch.spine.simulated import LEVELS, disturbed, surgery

COMPONENTS = (
    ("translation_mm", "translation_sd_mm"),
    ("rotation_vector_deg", "rotation_sd_deg"),
    ("derotation_deg", "derotation_sd_deg"),
    ("coronal_deg", "coronal_sd_deg"),
    ("sagittal_deg", "sagittal_sd_deg"),
    ("distraction_mm", "distraction_sd_mm"),
)
SOME = ("T9", "T11", "L1", "L3")


@pytest.mark.parametrize("marked", [LEVELS, SOME, ("T8", "L1")])
@pytest.mark.parametrize(("start", "end"), [("PRE", "POST"), ("INTER", "POST"), ("POST", "PRE")])
@pytest.mark.parametrize("given", [LEVELS, ("T8", "T9", "T11", "L1", "L3")])
def test_it_is_the_change_of_the_configurations(
    marked: tuple[str, ...], start: str, end: str, given: tuple[str, ...]
) -> None:
    case = surgery(1, marked, noise=0.4, initial_sd=1.5)
    rows = [LEVELS.index(name) for name in given]
    initial = case.setup.initial
    few = replace(
        initial,
        levels=given,
        position_mm=initial.position_mm[rows],
        rotation=initial.rotation[rows],
        errors=initial.errors[rows],
    )
    setup = replace(case.setup, initial=few)
    before, after = (spine_at_stage(setup, case.stages, stage) for stage in (start, end))
    full = vertebra_changes(before, after, setup.reference)
    expected = [change for change in full if change.vertebra in marked and change.vertebra in given]
    found = body_motion(setup, case.stages, start, end)
    assert [change.vertebra for change in found] == [name for name in given if name in marked]
    for a, b in zip(found, expected, strict=True):
        for field in fields(a):
            one, other = getattr(a, field.name), getattr(b, field.name)
            if isinstance(one, (float, np.ndarray)):
                assert np.allclose(one, other, atol=1e-9), field.name
            else:
                assert one == other


def test_bodies_move_as_the_truth_says() -> None:
    case = surgery(2, SOME)
    found = body_motion(case.setup, case.stages, "INTER", "POST")
    assert [change.vertebra for change in found] == list(SOME)
    for change in found:
        i = LEVELS.index(change.vertebra)
        before, after = case.truth["INTER"], case.truth["POST"]
        assert np.allclose(change.translation_mm, after.position_mm[i] - before.position_mm[i], atol=1e-9)
        assert np.allclose(change.rotation, after.rotation[i] @ before.rotation[i].T, atol=1e-12)


def test_intervals_cover_the_errors_of_triads_and_of_the_initial_configuration() -> None:
    rng = np.random.default_rng(11)
    inside: dict[str, list[bool]] = {}
    for seed in range(150):
        case = surgery(seed, noise=0.5, initial_sd=2.0)
        initial = case.setup.initial
        error = initial.errors @ rng.standard_normal(initial.errors.shape[2])
        wrong = replace(
            initial,
            position_mm=initial.position_mm + error[:, :3],
            rotation=rotation_from_vector(np.radians(error[:, 3:])) @ initial.rotation,
        )
        stages = {
            stage: {
                name: disturbed(pose, covariance_factor(pose.covariance) @ rng.standard_normal(6))
                for name, pose in poses.items()
            }
            for stage, poses in case.stages.items()
        }
        truth = body_motion(case.setup, case.stages, "INTER", "POST")
        found = body_motion(replace(case.setup, initial=wrong), stages, "INTER", "POST")
        for a, b in zip(found, truth, strict=True):
            if a.vertebra == "L1":
                continue
            for value, sd in COMPONENTS:
                z = np.abs(getattr(a, value) - getattr(b, value)) / getattr(a, sd)
                inside.setdefault(value, []).extend(np.ravel(z < 1.96))
    for value, hits in inside.items():
        assert 0.93 < np.mean(hits) < 0.975, value


def test_the_reference_does_not_move() -> None:
    case = surgery(3, SOME, noise=0.5, initial_sd=1.0)
    (still,) = [c for c in body_motion(case.setup, case.stages, "PRE", "POST") if c.vertebra == "L1"]
    assert np.allclose(still.translation_mm, 0)
    assert np.allclose(still.translation_sd_mm, 0)
    assert still.angle_deg == pytest.approx(0, abs=1e-6)
    assert still.angle_sd_deg == pytest.approx(0, abs=1e-6)


def test_only_vertebrae_that_both_stages_measured_are_listed() -> None:
    case = surgery(4, SOME)
    stages = {stage: dict(poses) for stage, poses in case.stages.items()}
    del stages["INTER"]["T9"]
    del stages["POST"]["T11"]
    names = [change.vertebra for change in body_motion(case.setup, stages, "INTER", "POST")]
    assert names == ["L1", "L3"]


def test_a_generic_spine_is_assumed_and_rebaselines_are_followed() -> None:
    case = surgery(5, SOME)
    setup = replace(
        case.setup,
        initial=replace(case.setup.initial, kind=InitialKind.GENERIC),
        rebaselines=(Rebaseline("T9", "PRE", "INTER"),),
    )
    changes = {c.vertebra: c for c in body_motion(setup, case.stages, "PRE", "INTER")}
    assert changes["T11"].origin is Origin.ASSUMED
    # The spine is declared not to have moved while T9's marker was clamped again.
    assert np.allclose(changes["T9"].translation_mm, 0, atol=1e-9)
    assert not np.allclose(changes["T11"].translation_mm, 0, atol=0.1)


def test_without_the_reference_there_is_no_motion() -> None:
    case = surgery(6, SOME)
    stages = {stage: dict(poses) for stage, poses in case.stages.items()}
    del stages["INTER"]["L1"]
    with pytest.raises(ReferenceMissingError, match="INTER"):
        body_motion(case.setup, stages, "INTER", "POST")


def test_it_imports_no_scipy() -> None:
    code = (
        "import spinewatch.spine.body_motion, sys; sys.exit('scipy' in sys.modules or 'cv2' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
