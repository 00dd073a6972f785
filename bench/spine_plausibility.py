"""How often the plausibility gates flag sound surgeries, and how often they see a clamp that slipped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np

from bench.spine_surgeries import STAGES, CartMotion, Surgery, simulated_surgery
from bench.spine_triads import measured_triads
from bench.tables import Bar, Grid
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scoliosis import CurveKind
from spinewatch.spine.plausibility import plausibility_flags
from spinewatch.triads.pose import Pose

CODES = (
    "reference-moved",
    "intervertebral-distance-implausible",
    "intervertebral-rotation-implausible",
    "neighbours-disagree",
)
THESIS_MARKERS = ("T7", "T9", "T11", "L1")
SLIP_DEG, SLIP_MM = 8.0, 3.0
CLAMPED_AGAIN_DEG = 45.0

Poses = Mapping[str, Pose]


def gates(count: int, seed: int = 12) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the rates on ``count`` surgeries of each set of markers, and their bars."""
    sets: Mapping[str, Callable[[np.random.Generator, CurveKind], Surgery]] = {
        "T7 T9 T11 L1": lambda rng, kind: simulated_surgery(
            rng, kind, marked=THESIS_MARKERS, cart=CartMotion(10, 20)
        ),
        "ends, apices and L5": lambda rng, kind: simulated_surgery(rng, kind, cart=CartMotion(10, 20)),
    }
    rows, checks = [], []
    for name, make in sets.items():
        rng = np.random.default_rng(seed)
        alarms: Counter[str] = Counter()
        seen: Counter[str] = Counter()
        pairs = still = 0
        for number in range(count):
            surgery = make(rng, list(CurveKind)[number % len(CurveKind)])
            stages = [_measured(surgery, stage, rng) for stage in STAGES]
            for before, after in pairwise(stages):
                if len(before) < 3 or set(before) != set(after) or surgery.reference not in after:
                    continue
                pairs += 1
                alarms.update({flag.code for flag in plausibility_flags(before, after, surgery.reference)})
                middle = sorted(after, key=list(before).index)[len(after) // 2 - 1]
                clamped = after | {middle: _turned(after[middle], rng, CLAMPED_AGAIN_DEG, 0.0)}
                seen["clamped"] += bool(plausibility_flags(before, clamped, surgery.reference))
            again = _measured(surgery, STAGES[0], rng)
            if set(again) == set(stages[0]) and surgery.reference in again and len(again) >= 3:
                still += 1
                slipped = again | {
                    surgery.reference: _turned(again[surgery.reference], rng, SLIP_DEG, SLIP_MM)
                }
                found = plausibility_flags(stages[0], slipped, surgery.reference)
                seen["slipped"] += any(flag.code == "reference-moved" for flag in found)
        rates = [100 * alarms[code] / pairs for code in CODES]
        rows.append([name, pairs, *(f"{rate:.1f}%" for rate in rates),
                     f"{100 * seen['slipped'] / still:.0f}%", f"{100 * seen['clamped'] / pairs:.0f}%"])  # fmt: skip
        checks += [
            Bar(f"{name}: a gate flags a sound pair of stages in at most 2%", f"{max(rates):.1f}%", max(rates) <= 2),
            Bar(f"{name}: a reference that slipped by {SLIP_DEG:g} degrees is seen in 90%",
                f"{100 * seen['slipped'] / still:.0f}%", seen["slipped"] >= 0.9 * still),
        ]  # fmt: skip
    grid = Grid.of(
        "Plausibility gates: share of sound pairs of stages that are flagged, and of faults that are seen",
        [
            "markers",
            "pairs",
            *CODES,
            f"reference slipped {SLIP_DEG:g} deg",
            f"marker turned {CLAMPED_AGAIN_DEG:g} deg",
        ],
        rows,
    )
    return [grid], tuple(checks)


def _measured(surgery: Surgery, stage: str, rng: np.random.Generator) -> dict[str, Pose]:
    truth = surgery.triads[stage]
    found = measured_triads(large_rig(), list(truth.values()), rng)
    return {label: pose for label, pose in zip(truth, found, strict=True) if pose is not None}


def _turned(pose: Pose, rng: np.random.Generator, degrees: float, shift_mm: float) -> Pose:
    """Return a pose turned about a random axis and displaced in a random direction."""
    axis, direction = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    turn = rotation_from_vector(np.radians(degrees) * axis)
    return Pose(pose.position_mm + shift_mm * direction, turn @ pose.rotation, pose.covariance)
