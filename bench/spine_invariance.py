"""What must not change a measure, and what must change its sign: cart motion, mirror image, names, without noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.spine_surgeries import BASELINE, STAGES, CartMotion, Surgery, moved_to, simulated_surgery
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.simulation.rigs import convergence_point, large_rig
from spinewatch.simulation.scoliosis import LEVELS, CurveKind
from spinewatch.spine.configuration import SpinePoses, SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.results import MeasureValue
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.triads.pose import Pose

_EXACT = 1e-9
_WHOLE_RANGE = CartMotion(rotation_deg=10.0, shift_mm=100.0)
_STATED_SD = (1.0, 1.0)
"""Stated deviations of the true initial poses, mm and degrees, so that intervals are compared too."""

_FLIP = np.diag([1.0, -1.0, 1.0])
"""Mirror in the patient's sagittal plane; of a prone patient along object x, also of object y."""

KEEP_SIGN = frozenset({"kyphosis", "lordosis", "angle-3d", "sagittal-tilt"})
"""Measures that a mirror image does not change; it changes the sign of all others."""


@dataclass(frozen=True)
class Changes:
    """Greatest change of a measure, degrees or mm, over all surgeries and stages, by what was done."""

    cart: float
    mirror: float
    relabelled: float
    values: int


def changes(count: int) -> Changes:
    """Return the changes over ``count`` surgeries of each kind."""
    found = []
    for number, kind in enumerate(CurveKind):
        for seed in range(count):
            rng = np.random.default_rng([12, 4, number, seed])
            surgery = simulated_surgery(rng, kind)
            before = _measures(surgery, surgery.exact_setup(LEVELS, *_STATED_SD))
            elsewhere = moved_to(surgery, rng, _WHOLE_RANGE)
            moved = _measures(elsewhere, elsewhere.exact_setup(LEVELS, *_STATED_SD))
            other = _mirrored(surgery)
            mirror = _measures(other, other.exact_setup(LEVELS, *_STATED_SD))
            upwards = _measures(surgery, _upwards(surgery))
            found.append(
                (
                    _greatest(before, moved, mirrored=False),
                    _greatest(before, mirror, mirrored=True),
                    _greatest(before, upwards, mirrored=False),
                    len(before),
                )
            )
    cart, mirror_change, relabelled, values = np.array(found).T
    return Changes(float(cart.max()), float(mirror_change.max()), float(relabelled.max()), int(values.sum()))


def grids_and_bars(found: Changes) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of changes and its bars."""
    rows = [
        ("the rig turned by up to 10 deg and moved by 100 mm, per axis, in every stage", f"{found.cart:.0e}"),
        ("left and right exchanged, signs turned back", f"{found.mirror:.0e}"),
        ("vertebrae named from the caudal end", f"{found.relabelled:.0e}"),
    ]
    title = f"Greatest change of {found.values} measures without noise, deg and mm"
    checks = (
        Bar(
            "turning the rig changes no measure by more than 1e-9", f"{found.cart:.0e}", found.cart <= _EXACT
        ),
        Bar(
            "a mirror image changes the right signs and nothing else",
            f"{found.mirror:.0e}",
            found.mirror <= _EXACT,
        ),
        Bar(
            "naming from the caudal end changes nothing",
            f"{found.relabelled:.0e}",
            found.relabelled <= _EXACT,
        ),
    )
    return [Grid.of(title, ["what was done", "change"], rows)], checks


def _measures(surgery: Surgery, setup: SpineSetup) -> list[MeasureValue]:
    baseline = spine_at_stage(setup, surgery.triads, BASELINE)
    spines = [baseline, *(spine_at_stage(setup, surgery.triads, stage) for stage in STAGES[1:])]
    return [value for spine in spines for value in measure_spine(spine, baseline).measures]


def _greatest(before: Sequence[MeasureValue], after: Sequence[MeasureValue], *, mirrored: bool) -> float:
    """Return the greatest change; infinite if the measures are not the same ones."""
    if len(before) != len(after):
        return np.inf
    worst = 0.0
    for a, b in zip(before, after, strict=True):
        if (a.definition, a.levels, a.status) != (b.definition, b.levels, b.status):
            return np.inf
        if np.isnan(a.value):
            continue
        sign = -1.0 if mirrored and a.definition not in KEEP_SIGN else 1.0
        pairs = [(a.value, sign * b.value), (a.sd, b.sd)]
        ends = (b.lower, b.upper) if sign > 0 else (-b.upper, -b.lower)
        pairs += zip((a.lower, a.upper), ends, strict=True)
        worst = max(worst, *(abs(x - y) for x, y in pairs))
    return worst


def _mirrored(surgery: Surgery) -> Surgery:
    """Return the mirror image of a surgery in the plane of object x and z."""
    middle = convergence_point(large_rig())[1] * np.array([0.0, 2.0, 0.0])

    def point(position_mm: Float) -> Float:
        return np.asarray(middle + position_mm @ _FLIP)

    bodies = {
        stage: SpinePoses(point(poses.position_mm), _FLIP @ poses.rotation @ _FLIP)
        for stage, poses in surgery.bodies.items()
    }
    triads = {
        stage: {
            level: Pose(point(pose.position_mm), _FLIP @ pose.rotation @ _FLIP, pose.covariance)
            for level, pose in poses.items()
        }
        for stage, poses in surgery.triads.items()
    }
    return replace(surgery, bodies=bodies, triads=triads)


def _upwards(surgery: Surgery) -> SpineSetup:
    """Return the exact setup with the initial poses given from the caudal end."""
    setup = surgery.exact_setup(LEVELS, *_STATED_SD)
    given = setup.initial
    initial = initial_from_poses(
        given.levels[::-1],
        given.position_mm[::-1],
        given.rotation[::-1],
        *_STATED_SD,
        frame="object",
        patient_axes=surgery.patient_axes,
        triads={level: surgery.triads[BASELINE][level] for level in reversed(surgery.marked)},
    )
    return replace(setup, initial=initial)
