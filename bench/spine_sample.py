"""The sample surgery: motion since PRE beside the truth, of the triads and of bodies under them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.scenes import measure_scene
from bench.scoring import rms
from bench.tables import Bar, Grid
from bench.truth import Scene, find_scenes, read_surgery
from spinewatch.arrays import Bool, Float
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.simulation.scoliosis import prone_axes
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.configuration import Origin, SpineConfiguration, SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.motion import relative_motion
from spinewatch.spine.results import VertebraChange
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.triads.pose import Pose

SAMPLE = Path("samples/D1")
_BASELINE = "PRE"
_BODY_BELOW_MM = 45.0

Poses = Mapping[str, Mapping[str, Pose]]


@dataclass(frozen=True, eq=False)
class Motion:
    """Errors of the motion of one vertebra since PRE and their stated deviations, shape (6,), mm and degrees."""

    of: str
    stage: str
    vertebra: str
    error: Float
    sd: Float

    @property
    def inside(self) -> Bool:
        """Whether each component lies in its 95% interval, shape (6,)."""
        return np.asarray(np.abs(self.error) <= 1.96 * self.sd)


def sample_motions(folder: Path = SAMPLE) -> tuple[Motion, ...]:
    """Return the motions of the triads and of the bodies in every stage after PRE of a rendered surgery."""
    scores = {scene.folder.name: measure_scene(scene) for scene in find_scenes(folder)}
    measured = {stage: score.poses for stage, score in scores.items()}
    true = {stage: _true_poses(score.scene) for stage, score in scores.items()}
    surgery = read_surgery(folder)
    if surgery is None:
        raise FileNotFoundError(folder / "surgery.json")
    found = []
    for stage, poses in measured.items():
        if stage == _BASELINE:
            continue
        for motion in relative_motion(measured[_BASELINE], poses, surgery.reference):
            known = surgery.motion[stage][motion.vertebra]
            turn = np.degrees(vector_from_rotation(known.rotation)) - motion.rotation_vector_deg
            error = np.concatenate([known.translation_mm - motion.translation_mm, turn])
            sd = np.concatenate([motion.translation_sd_mm, motion.rotation_sd_deg])
            found.append(Motion("triad", stage, motion.vertebra, error, sd))
        found += _bodies(true, measured, stage, surgery.reference)
    return tuple(found)


def grids_and_bars(motions: tuple[Motion, ...]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of the sample surgery and its bars."""
    rows, checks = [], []
    for of in ("triad", "body"):
        part = [motion for motion in motions if motion.of == of]
        inside = np.concatenate([motion.inside for motion in part])
        share = 100 * float(inside.mean())
        errors, sd = np.stack([motion.error for motion in part]), np.stack([motion.sd for motion in part])
        rows.append(
            (
                of,
                len(part),
                f"{rms(np.linalg.norm(errors[:, :3], axis=1)):.2f}",
                f"{rms(np.linalg.norm(sd[:, :3], axis=1)):.2f}",
                f"{rms(np.linalg.norm(errors[:, 3:], axis=1)):.2f}",
                f"{rms(np.linalg.norm(sd[:, 3:], axis=1)):.2f}",
                f"{int(inside.sum())}/{inside.size}",
            )
        )
        promise = f"sample surgery: motion of every {of} since PRE in its 95% intervals in >= 90%"
        checks.append(Bar(promise, f"{share:.0f}% of {inside.size} components", share >= 90))
    columns = ["motion of", "n", "error mm", "stated", "error deg", "stated", "components in 95%"]
    return [Grid.of("Sample surgery D1, motion since PRE, RMS", columns, rows)], tuple(checks)


def _true_poses(scene: Scene) -> dict[str, Pose]:
    return {t.vertebra: Pose(t.position_mm, t.rotation, np.zeros((6, 6))) for t in scene.triads}


def _bodies(true: Poses, measured: Poses, stage: str, reference: str) -> list[Motion]:
    """Return the errors of the motions of bodies below the triads, whose places at PRE are known."""
    axes, levels = prone_axes("x"), tuple(true[_BASELINE])
    below = np.array([0.0, 0.0, -_BODY_BELOW_MM])

    def changes(poses: Poses) -> tuple[VertebraChange, ...]:
        initial = initial_from_poses(
            levels,
            np.stack([pose.position_mm + below for pose in true[_BASELINE].values()]),
            np.stack([axes] * len(levels)),
            0.0,
            0.0,
            frame="object",
            patient_axes=axes,
            triads=poses[_BASELINE],
        )
        setup = SpineSetup(axes, reference, _BASELINE, initial)
        before, after = (_spine(setup, poses, name) for name in (_BASELINE, stage))
        return vertebra_changes(before, after, reference)

    known = {change.vertebra: change for change in changes(true)}
    found = []
    for change in changes(measured):
        if change.vertebra == reference or change.origin is not Origin.MEASURED:
            continue
        truth = known[change.vertebra]
        error = [
            truth.translation_mm - change.translation_mm,
            truth.rotation_vector_deg - change.rotation_vector_deg,
        ]
        sd = np.concatenate([change.translation_sd_mm, change.rotation_sd_deg])
        found.append(Motion("body", stage, change.vertebra, np.concatenate(error), sd))
    return found


def _spine(setup: SpineSetup, poses: Poses, stage: str) -> SpineConfiguration:
    return spine_at_stage(setup, {name: poses[name] for name in {_BASELINE, stage}}, stage)
