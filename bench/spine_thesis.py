"""The controlled test that section 6.3 of the thesis asks for: known motions, read by eq. 6.1 and by ours.

A triad lies parallel to the bed, 40 mm above the body of its vertebra. The reference triad does not move.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.scoring import rms
from bench.spine_triads import measured_triads
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.simulation.rigs import convergence_point, large_rig
from spinewatch.simulation.scoliosis import prone_axes
from spinewatch.spine.motion import VertebraMotion, relative_motion
from spinewatch.thesis_1995.motion import axis_and_angle, move_body
from spinewatch.triads.pose import Pose

BODY_BELOW_MM = 40.0
_REFERENCE, _VERTEBRA = "L1", "T11"
_EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class KnownMotion:
    """A motion of a vertebra about the centroid of its body: rotation vector, degrees, and translation, mm.

    Both are in patient axes: x anterior, y left, z cephalad.
    """

    name: str
    rotation_deg: tuple[float, float, float]
    translation_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


COMBINATION = KnownMotion(
    "all of them: 20 coronal, 15 axial, 10 sagittal, 5 mm aside, 8 mm up", (20, 10, 15), (0, 5, 8)
)
MOTIONS = (
    KnownMotion("coronal tilt by 20 deg", (20, 0, 0)),
    KnownMotion("sagittal tilt by 20 deg", (0, 20, 0)),
    KnownMotion("axial rotation by 20 deg", (0, 0, 20)),
    KnownMotion("axial rotation by 100 deg", (0, 0, 100)),
    KnownMotion("translation by 10 mm to the left", (0, 0, 0), (0, 10, 0)),
    KnownMotion("distraction by 10 mm", (0, 0, 0), (0, 0, 10)),
    COMBINATION,
)


@dataclass(frozen=True, eq=False)
class Reading:
    """What a method makes of a motion: rotation in patient axes, (3, 3), and place of the body, object space, mm."""

    rotation: Float
    body_mm: Float

    def tilts_deg(self) -> Float:
        """Return the coronal, sagittal and axial parts of the rotation, shape (3,), degrees."""
        x, _, z = self.rotation.T
        coronal, sagittal = np.arctan2(-z[1], z[2]), np.arctan2(z[0], z[2])
        return np.degrees([coronal, sagittal, np.arctan2(x[1], x[0])])

    def errors(self, truth: Reading) -> tuple[float, float]:
        """Return the angle between the rotations, degrees, and the distance between the bodies, mm."""
        angle = np.linalg.norm(vector_from_rotation(self.rotation @ truth.rotation.T))
        return float(np.degrees(angle)), float(np.linalg.norm(self.body_mm - truth.body_mm))


@dataclass(frozen=True, eq=False)
class Trial:
    """One motion: the truth, both readings without noise, and the errors of ours with the rig's noise.

    ``noisy_deg`` and ``noisy_mm`` are RMS errors; ``covered`` is the percentage of rotations and translations of the
    triad in their 95% regions.
    """

    motion: KnownMotion
    truth: Reading
    thesis: Reading
    ours: Reading
    noisy_deg: float
    noisy_mm: float
    covered: tuple[float, float]


def trials(count: int) -> tuple[Trial, ...]:
    """Return a trial of each motion, measured ``count`` times with the rig's noise."""
    rng = np.random.default_rng([12, 1])
    return tuple(_trial(motion, count, rng) for motion in MOTIONS)


def grids_and_bars(found: Sequence[Trial]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of the controlled test and its bars."""
    rows = []
    for t in found:
        thesis_deg, thesis_mm = t.thesis.errors(t.truth)
        ours_deg, ours_mm = t.ours.errors(t.truth)
        rows.append(
            (
                t.motion.name,
                _three(t.truth.tilts_deg()),
                _three(t.thesis.tilts_deg()),
                f"{thesis_deg:.2f}",
                f"{thesis_mm:.2f}",
                f"{ours_deg:.0e}",
                f"{ours_mm:.0e}",
                f"{t.noisy_deg:.2f}",
                f"{t.noisy_mm:.2f}",
            )
        )
    columns = [
        "motion of the vertebra",
        "true: coronal, sagittal, axial",
        "eq. 6.1 reads",
        "its error deg",
        "its body mm",
        "ours deg",
        "ours mm",
        "0.1 px deg",
        "0.1 px mm",
    ]
    title = f"Section 6.3: a triad parallel to the bed, {BODY_BELOW_MM:g} mm above the body"
    return [Grid.of(title, columns, rows)], tuple(_bars(found))


def _bars(found: Sequence[Trial]) -> list[Bar]:
    coronal = found[0].thesis.tilts_deg()
    body = max(t.thesis.errors(t.truth)[1] for t in found if t.motion is not COMBINATION)
    worst = max(max(t.ours.errors(t.truth)) for t in found)
    shares = [share for t in found for share in t.covered]
    return [
        Bar(
            "eq. 6.1 reads a coronal tilt of 20 deg as 0",
            f"{abs(coronal[0]):.1e} deg",
            bool(np.abs(coronal).max() < _EXACT),
        ),
        Bar("and misplaces a body 40 mm below P by millimetres", f"up to {body:.1f} mm", body > 1),
        Bar("the full motion is exact without noise, deg and mm", f"{worst:.0e}", worst < _EXACT),
        Bar(
            "with the rig's noise in its 95% regions in 93-97%",
            f"{min(shares):.1f} to {max(shares):.1f}%, mean {np.mean(shares):.1f}%",
            93 <= float(np.mean(shares)) <= 97,
        ),
    ]


def _trial(motion: KnownMotion, count: int, rng: np.random.Generator) -> Trial:
    axes, middle = prone_axes("x"), convergence_point(large_rig())
    above = np.array([0.0, 0.0, BODY_BELOW_MM])
    turn = rotation_from_vector(np.radians(motion.rotation_deg))
    R = axes @ turn @ axes.T
    body, zero = middle + np.array([60.0, 0.0, -BODY_BELOW_MM]), np.zeros((6, 6))
    body_after = body + axes @ np.array(motion.translation_mm)
    reference = Pose(middle - [60.0, 0.0, 0.0], rotation_from_vector(np.array([0.1, -0.2, 0.5])), zero)
    azimuth = rotation_from_vector(np.array([0.0, 0.0, 0.7]))
    before = {_REFERENCE: reference, _VERTEBRA: Pose(body + above, azimuth, zero)}
    after = {_REFERENCE: reference, _VERTEBRA: Pose(body_after + R @ above, R @ azimuth, zero)}
    truth = Reading(turn, body_after)
    ours = _full(before, after, body, axes)
    errors, inside = [], []
    stages = measured_triads(large_rig(), [*before.values(), *after.values()] * count, rng)
    for first in range(0, len(stages), 4):
        measured = [pose for pose in stages[first : first + 4] if pose is not None]
        if len(measured) < 4:
            continue
        start, end = (dict(zip(before, measured[i : i + 2], strict=True)) for i in (0, 2))
        errors.append(_full(start, end, body, axes).errors(truth))
        (true,), (found,) = (relative_motion(*pair, _REFERENCE) for pair in ((before, after), (start, end)))
        inside.append(_inside(true, found))
    noisy = np.array(errors).reshape(-1, 2)
    covered = 100 * np.mean(np.array(inside).reshape(-1, 2, 3), axis=(0, 2)) if inside else np.full(2, np.nan)
    return Trial(
        motion,
        truth,
        _thesis(before[_VERTEBRA], after[_VERTEBRA], body, axes),
        ours,
        rms(noisy[:, 0]),
        rms(noisy[:, 1]),
        (float(covered[0]), float(covered[1])),
    )


def _inside(true: VertebraMotion, found: VertebraMotion) -> Float:
    """Return whether the components of translation and rotation (2, 3) lie in their 95% intervals."""
    translation = np.abs(found.translation_mm - true.translation_mm) <= 1.96 * found.translation_sd_mm
    rotation = np.abs(found.rotation_vector_deg - true.rotation_vector_deg) <= 1.96 * found.rotation_sd_deg
    return np.array([translation, rotation], dtype=np.float64)


def _thesis(before: Pose, after: Pose, body_mm: Float, axes: Float) -> Reading:
    """Return what eq. 6.1 makes of the motion of a triad."""
    axis, angle = axis_and_angle(before.normal, after.normal)
    R = rotation_from_vector(axis * np.radians(angle))
    moved, _ = move_body(
        body_mm, axes[:, 2], before.position_mm, after.position_mm, before.normal, after.normal
    )
    return Reading(axes.T @ R @ axes, moved)


def _full(before: dict[str, Pose], after: dict[str, Pose], body_mm: Float, axes: Float) -> Reading:
    """Return what the motion with all six degrees of freedom makes of it."""
    (motion,) = relative_motion(before, after, _REFERENCE)
    at_first, at_last = before[_REFERENCE], after[_REFERENCE]
    R = motion.rotation
    arm = at_first.rotation.T @ (body_mm - before[_VERTEBRA].position_mm)
    P = at_last.rotation.T @ (after[_VERTEBRA].position_mm - at_last.position_mm)
    body = at_last.position_mm + at_last.rotation @ (P + R @ arm)
    turn = at_last.rotation @ R @ at_first.rotation.T
    return Reading(axes.T @ turn @ axes, body)


def _three(values: Float) -> str:
    return " ".join(f"{value + 0.0:.1f}" for value in values.round(1))
