"""Simulated surgeries: a scoliotic spine, its stages, what the cart sees of them, and the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from bench.spine_triads import RIG_NOISE, measured_triads
from bench.spine_truth import true_ends
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.observations import FeatureNoise
from spinewatch.simulation.rigs import convergence_point, large_rig
from spinewatch.simulation.scoliosis import (
    LEVELS,
    CurveKind,
    Manoeuvre,
    MountParameters,
    ScoliosisParameters,
    SimulatedSpine,
    corrected,
    moved_cart,
    placed,
    prone_axes,
    random_mounts,
    random_scoliosis,
    triads_on,
)
from spinewatch.spine.configuration import InitialSpine, Origin, SpineConfiguration, SpinePoses, SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.triads.pose import Pose

BASELINE, INTER, POST = "PRE", "INTER", "POST"
STAGES = (BASELINE, INTER, POST)

Markers = Literal["ends and apices", "ends, apices and L5"]
"""Which vertebrae carry a triad: the end vertebrae, and more."""


@dataclass(frozen=True)
class CartMotion:
    """Greatest motion of the cart between stages: rotation, degrees, and shift per axis, mm."""

    rotation_deg: float = 10.0
    shift_mm: float = 20.0


@dataclass(frozen=True, eq=False)
class Surgery:
    """A simulated surgery.

    Attributes
    ----------
    kind
        Curves of the spine.
    marked
        Vertebrae with a triad, from cranial to caudal.
    reference
        Vertebra of the reference triad.
    patient_axes
        Rotation from patient to object axes of the baseline.
    spines
        True spines by stage, patient axes.
    bodies
        True poses of all bodies by stage, object space of that stage.
    triads
        True poses of the triads by stage, object space of that stage.
    mounts
        Poses of the triads in the axes of their vertebrae.
    """

    kind: CurveKind
    marked: tuple[str, ...]
    reference: str
    patient_axes: Float
    spines: Mapping[str, SimulatedSpine]
    bodies: Mapping[str, SpinePoses]
    triads: Mapping[str, Mapping[str, Pose]]
    mounts: Mapping[str, Pose]

    def in_object_space(self, stage: str, poses: SpinePoses) -> SpinePoses:
        """Return poses in patient axes, of the spine at a stage, in object space of that stage."""
        own, seen = self.spines[stage].poses, self.bodies[stage]
        R = seen.rotation[0] @ own.rotation[0].T
        return SpinePoses(
            seen.position_mm[0] + (poses.position_mm - own.position_mm[0]) @ R.T, R @ poses.rotation
        )

    def truth(self, stage: str) -> SpinePoses:
        """Return the true poses at a stage in patient axes that the reference triad carries."""
        before, now = (self.triads[name][self.reference] for name in (BASELINE, stage))
        turn = before.rotation @ now.rotation.T
        bodies = self.bodies[stage]
        at_baseline = before.position_mm + (bodies.position_mm - now.position_mm) @ turn.T
        origin = self.bodies[BASELINE].position_mm[LEVELS.index(self.reference)]
        axes = self.patient_axes
        return SpinePoses((at_baseline - origin) @ axes, axes.T @ turn @ bodies.rotation)

    def true_configuration(self, stage: str) -> SpineConfiguration:
        """Return the truth at a stage as a configuration that every level is measured in, without error."""
        n = len(LEVELS)
        poses = self.truth(stage)
        return SpineConfiguration(
            LEVELS, (True,) * n, (Origin.MEASURED,) * n, (None,) * n, poses, {}, (poses,), False
        )

    def exact_setup(
        self, levels: Sequence[str] = LEVELS, position_sd_mm: float = 0.0, rotation_sd_deg: float = 0.0
    ) -> SpineSetup:
        """Return the setup with the true initial poses of some levels, which are said to err by the deviations."""
        rows = [LEVELS.index(level) for level in levels]
        bodies = self.bodies[BASELINE]
        return self._setup(
            levels, bodies.position_mm[rows], bodies.rotation[rows], position_sd_mm, rotation_sd_deg
        )

    def uncertain_setup(
        self,
        rng: np.random.Generator,
        position_sd_mm: float,
        rotation_sd_deg: float,
        axes_sd_deg: float = 0.0,
        frame: Literal["object", "patient"] = "object",
    ) -> SpineSetup:
        """Return a setup with initial poses of all levels, and patient axes, that err by the given deviations per axis.

        Poses in frame ``patient`` are those of the true axes, which the setup then places by axes that err.
        """
        shift = position_sd_mm * rng.standard_normal((len(LEVELS), 3))
        turn = rotation_from_vector(np.radians(rotation_sd_deg) * rng.standard_normal((len(LEVELS), 3)))
        wrong = (
            rotation_from_vector(np.radians(axes_sd_deg) * rng.standard_normal(3))
            if axes_sd_deg
            else np.eye(3)
        )
        bodies = self.bodies[BASELINE] if frame == "object" else self.truth(BASELINE)
        stated = replace(self, patient_axes=self.patient_axes @ wrong)
        setup = stated._setup(
            LEVELS, bodies.position_mm + shift, turn @ bodies.rotation, position_sd_mm, rotation_sd_deg, frame
        )
        return replace(setup, axes_covariance_deg2=axes_sd_deg**2 * np.eye(3))

    def _setup(
        self,
        levels: Sequence[str],
        position_mm: Float,
        rotation: Float,
        position_sd: float,
        rotation_sd: float,
        frame: Literal["object", "patient"] = "object",
    ) -> SpineSetup:
        initial: InitialSpine = initial_from_poses(
            tuple(levels),
            position_mm,
            rotation,
            position_sd,
            rotation_sd,
            frame=frame,
            patient_axes=self.patient_axes,
            triads=self.triads[BASELINE],
        )
        return SpineSetup(self.patient_axes, self.reference, BASELINE, initial)


def simulated_surgery(  # noqa: PLR0913
    rng: np.random.Generator,
    kind: CurveKind,
    markers: Markers = "ends, apices and L5",
    *,
    marked: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    parameters: ScoliosisParameters | None = None,
    manoeuvres: Sequence[Manoeuvre] | None = None,
    cart: CartMotion | None = None,
    mounts: MountParameters | None = None,
) -> Surgery:
    """Return a random surgery.

    Parameters
    ----------
    rng
        Source of random numbers.
    kind
        Curves of the spine.
    markers
        Which vertebrae carry a triad.
    marked
        The vertebrae that carry one, instead of ``markers``.
    extra
        More vertebrae with a triad.
    parameters
        Ranges of the spine.
    manoeuvres
        What is done before each stage after the baseline; by default random.
    cart
        How far the cart moves between the stages.
    mounts
        How the triads are clamped.
    """
    before = random_scoliosis(rng, kind, parameters)
    done = manoeuvres or (random_manoeuvre(rng), random_manoeuvre(rng))
    spines = [before]
    for manoeuvre in done:
        spines.append(corrected(spines[-1], manoeuvre, rng))
    if marked is None:
        ends = true_ends(before.poses, before.ends)
        apices = {round((a + b) / 2) for a, b in pairwise(ends)}
        last = {len(LEVELS) - 1} if markers == "ends, apices and L5" else set()
        marked = [LEVELS[i] for i in {*ends, *apices, *last}]
    chosen = tuple(level for level in LEVELS if level in {*marked, *extra})
    clamped = random_mounts(rng, chosen, mounts)
    axes, limits = prone_axes("x"), cart or CartMotion()
    middle = convergence_point(large_rig())
    bodies = {}
    for number, (stage, spine) in enumerate(zip(STAGES, spines, strict=False)):
        poses = placed(spine.poses, axes, middle - [0.0, 0.0, 45.0])
        if number:
            poses = moved_cart(poses, *random_cart_motion(rng, limits), middle)
        bodies[stage] = poses
    triads = {stage: triads_on(poses, clamped) for stage, poses in bodies.items()}
    by_stage = dict(zip(STAGES, spines, strict=False))
    return Surgery(kind, chosen, chosen[-1], axes, by_stage, bodies, triads, clamped)


def random_manoeuvre(rng: np.random.Generator) -> Manoeuvre:
    """Return a random manoeuvre of a strength that is usual."""
    return Manoeuvre(
        straightening=rng.uniform(0.0, 0.4),
        rod_rotation_deg=rng.uniform(-20.0, 20.0),
        derotation=rng.uniform(0.0, 0.4),
        distraction_mm=rng.uniform(0.0, 15.0),
    )


def random_cart_motion(rng: np.random.Generator, limits: CartMotion) -> tuple[Float, Float]:
    """Return a random rotation (3, 3) and shift (3,) within the limits."""
    axis = rng.standard_normal(3)
    axis *= np.radians(rng.uniform(0, limits.rotation_deg)) / np.linalg.norm(axis)
    return rotation_from_vector(axis), rng.uniform(-limits.shift_mm, limits.shift_mm, 3)


def moved_to(surgery: Surgery, rng: np.random.Generator, limits: CartMotion) -> Surgery:
    """Return the same surgery with the cart elsewhere in every stage, the baseline included.

    The patient axes turn with the object space of the baseline.
    """
    middle = convergence_point(large_rig())
    bodies, triads, axes = {}, {}, surgery.patient_axes
    for stage, poses in surgery.bodies.items():
        R, shift = random_cart_motion(rng, limits)
        bodies[stage] = moved_cart(poses, R, shift, middle)
        triads[stage] = {
            level: Pose(middle + shift + R @ (pose.position_mm - middle), R @ pose.rotation, pose.covariance)
            for level, pose in surgery.triads[stage].items()
        }
        axes = R @ axes if stage == BASELINE else axes
    return replace(surgery, bodies=bodies, triads=triads, patient_axes=axes)


def measured_stages(
    surgeries: Sequence[Surgery], rng: np.random.Generator, noise: FeatureNoise = RIG_NOISE
) -> list[dict[str, dict[str, Pose]]]:
    """Return the measured poses of the triads of every stage of each surgery; lost triads are absent."""
    keys = [
        (number, stage, level)
        for number, surgery in enumerate(surgeries)
        for stage, triads in surgery.triads.items()
        for level in triads
    ]
    true = [surgeries[number].triads[stage][level] for number, stage, level in keys]
    found: list[dict[str, dict[str, Pose]]] = [{stage: {} for stage in s.triads} for s in surgeries]
    for (number, stage, level), pose in zip(
        keys, measured_triads(large_rig(), true, rng, noise), strict=True
    ):
        if pose is not None:
            found[number][stage][level] = pose
    return found
