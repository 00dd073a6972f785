"""Mistakes of persons in the setup of a spine, and how often the checks see them, on simulated surgeries.

Spines are of adolescents, adults, children, with a kyphosis or a mild curve; 3 to 8 vertebrae carry triads, and initial
poses are given of all vertebrae, of most, or of the marked ones only.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from bench.spine_surgeries import (
    BASELINE,
    INTER,
    CartMotion,
    Surgery,
    measured_stages,
    random_cart_motion,
    simulated_surgery,
)
from bench.tables import Bar, Grid
from spinewatch.arrays import Float, Int
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.levels import level_numbers
from spinewatch.simulation.rigs import convergence_point, large_rig
from spinewatch.simulation.scoliosis import (
    LEVELS,
    CurveKind,
    MountParameters,
    ScoliosisParameters,
    moved_cart,
    triads_on,
)
from spinewatch.spine.configuration import Rebaseline, SpinePoses, SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.initial_reversals import initial_reversal_flags
from spinewatch.spine.initial_tilts import InitialTiltParameters, initial_tilt_flags
from spinewatch.spine.orientation import rotation_from_tilts, tilts_of
from spinewatch.spine.rebaseline_checks import rebaseline_flags

POPULATIONS: Mapping[str, ScoliosisParameters] = {
    "adolescent": ScoliosisParameters(irregularity_sd_deg=2.0),
    "adult": ScoliosisParameters(
        cobb_deg=(15.0, 60.0),
        kyphosis_deg=(20.0, 65.0),
        lordosis_deg=(5.0, 45.0),
        axial_per_cobb=(0.2, 0.6),
        irregularity_sd_deg=4.0,
    ),
    "child": ScoliosisParameters(height_sd=0.2, irregularity_sd_deg=2.0),
    "kyphosis": ScoliosisParameters(
        cobb_deg=(1.0, 15.0), kyphosis_deg=(50.0, 85.0), lordosis_deg=(30.0, 70.0), irregularity_sd_deg=2.0
    ),
    "mild": ScoliosisParameters(cobb_deg=(5.0, 25.0), irregularity_sd_deg=2.0),
}
"""Spines of patients; T1 to L5 of all."""

MOUNTS = (MountParameters(), MountParameters(sd_mm=8.0, tilt_sd_deg=10.0))
"""Clamps as usual, and such as vary more."""

AXES_SD_DEG = 3.0
POSITION_SD_MM, TILT_SDS_DEG = 2.0, (3.0, 6.0)
"""Errors of the initial poses; those of the rotations include what end plates differ from the line of the bodies by."""

STATED_SD = (2.0, 3.0)
"""Deviations that setups have unless they state others, mm and degrees."""

LARGE_DEG = 30.0
"""Coronal tilts over such a range make a large curve."""

SETTLING_MM, SETTLING_DEG = 0.5, 0.5
LOST_DEG = 5.0
"""Coronal motion of a re-clamped vertebra against the reference that is a serious loss."""

REVERSALS = {
    "left and right": (1.0, -1.0, 1.0),
    "front and back": (-1.0, 1.0, 1.0),
    "both": (-1.0, -1.0, 1.0),
}
SCALES = {"coronal tilts 0": 0.0, "halved": 0.5, "doubled": 2.0}
OTHER = "other patient"
POSE_CODES = frozenset({"initial-poses-reversed", "initial-poses-misfit"})
TILT_CODES = frozenset({"initial-tilts-doubtful"})

_WITHOUT_SIGNS = InitialTiltParameters(max_rms_deg=180.0)
"""Only the size of tilts is checked; tests/spinewatch/spine/test_initial_tilts.py has the rates of their signs."""

Size = Literal["large", "small"]


@dataclass
class Rates:
    """How many setups were seen to be wrong, by size of the curve and mistake; no mistake is ''.

    Attributes
    ----------
    setups
        Number of setups by size, but those whose angles are refused without a mistake.
    poses, tilts
        How many were refused, or flagged with a code of `POSE_CODES` or of `TILT_CODES`.
    clamped
        Re-clamped markers: ``still`` and ``settled`` spines and ``moved`` ones, of those ``lost`` with a serious loss.
    clamped_seen
        How many of them were flagged.
    """

    setups: Counter[Size] = field(default_factory=Counter)
    poses: Counter[tuple[Size, str]] = field(default_factory=Counter)
    tilts: Counter[tuple[Size, str]] = field(default_factory=Counter)
    clamped: Counter[str] = field(default_factory=Counter)
    clamped_seen: Counter[str] = field(default_factory=Counter)


def rates(count: int, seed: int = 12) -> Rates:
    """Return the rates on ``count`` surgeries."""
    found = Rates()
    for number in range(count):
        rng = np.random.default_rng([seed, 4, number])
        surgery = varied_surgery(rng, number)
        _count_setups(found, surgery, number, rng)
        _count_clamped(found, surgery, rng)
    return found


def varied_surgery(rng: np.random.Generator, number: int) -> Surgery:
    """Return a surgery of one of the populations with triads on 3 to 8 vertebrae within 5 levels or more."""
    parameters = list(POPULATIONS.values())[number % len(POPULATIONS)]
    n = int(rng.integers(3, 9))
    span = max(n, 5)
    first = int(rng.integers(0, len(LEVELS) - span))
    last = int(rng.integers(first + span - 1, len(LEVELS)))
    marked = np.sort(rng.choice(np.arange(first, last + 1), n, replace=False))
    return simulated_surgery(
        rng,
        list(CurveKind)[int(rng.integers(len(CurveKind)))],
        marked=[LEVELS[i] for i in marked],
        parameters=parameters,
        mounts=MOUNTS[number // len(POPULATIONS) % len(MOUNTS)],
    )


def _count_setups(found: Rates, surgery: Surgery, number: int, rng: np.random.Generator) -> None:
    rows = _rows(surgery, number, rng)
    n = len(rows)
    own = surgery.truth(BASELINE)
    errors = rotation_from_vector(np.radians(TILT_SDS_DEG[number % 2]) * rng.standard_normal((n, 3)))
    position = own.position_mm[rows] + POSITION_SD_MM * rng.standard_normal((n, 3))
    rotation = errors @ own.rotation[rows]
    other = varied_surgery(rng, number).truth(BASELINE)
    wrong = rotation_from_vector(np.radians(AXES_SD_DEG) * rng.standard_normal(3))
    given = {
        "": SpinePoses(position, rotation),
        OTHER: SpinePoses(other.position_mm[rows], other.rotation[rows]),
    }
    for name, signs in REVERSALS.items():
        F = np.diag(signs)
        given[name] = SpinePoses(position @ F, F @ rotation @ F)
    coronal, sagittal, axial = tilts_of(rotation)
    for name, scale in SCALES.items():
        given[name] = SpinePoses(position, rotation_from_tilts(scale * coronal, sagittal, axial))
    frame: Literal["patient", "object"] = "patient" if number % 4 < 2 else "object"
    codes = {name: _codes(surgery, rows, poses, wrong, frame) for name, poses in given.items()}
    if codes[""] is None:
        return
    size: Size = "large" if np.ptp(tilts_of(own.rotation[rows])[0]) > LARGE_DEG else "small"
    found.setups[size] += 1
    for name, seen in codes.items():
        found.poses[size, name] += seen is None or bool(seen & POSE_CODES)
        found.tilts[size, name] += seen is None or bool(seen & TILT_CODES)


def _rows(surgery: Surgery, number: int, rng: np.random.Generator) -> Int:
    """Return the vertebrae with an initial pose: all, those between the triads, most of either, or the marked ones."""
    marked = np.array([LEVELS.index(level) for level in surgery.marked])
    rows = np.arange(len(LEVELS)) if number % 3 == 0 else np.arange(marked[0], marked[-1] + 1)
    if number % 3 == 2:
        return marked
    missing = (rng.random(len(rows)) < (0.25 if number % 6 > 2 else 0.0)) & ~np.isin(rows, marked)
    return np.asarray(rows[~missing])


def _codes(
    surgery: Surgery, rows: Int, poses: SpinePoses, wrong: Float, frame: Literal["patient", "object"]
) -> frozenset[str] | None:
    """Return the codes of the flags of poses in patient axes, whose stated axes err; None if they are refused."""
    levels = tuple(LEVELS[i] for i in rows)
    axes, triads = surgery.patient_axes @ wrong, surgery.triads[BASELINE]
    position, rotation = poses.position_mm, poses.rotation
    if frame == "object":
        origin = surgery.bodies[BASELINE].position_mm[LEVELS.index(surgery.reference)]
        position, rotation = origin + position @ surgery.patient_axes.T, surgery.patient_axes @ rotation
    try:
        initial = initial_from_poses(
            levels, position, rotation, *STATED_SD, frame=frame, patient_axes=axes, triads=triads
        )
        setup = SpineSetup(
            axes, surgery.reference, BASELINE, initial, axes_covariance_deg2=AXES_SD_DEG**2 * np.eye(3)
        )
        flags: tuple[Flag, ...] = (
            *initial_reversal_flags(setup, triads),
            *initial_tilt_flags(
                levels,
                level_numbers(levels),
                initial.position_mm @ axes,
                axes.T @ initial.rotation,
                _WITHOUT_SIGNS,
                stated_sd=np.tile(STATED_SD, (len(rows), 1)),
            ),
        )
    except ParameterError:
        return None
    return frozenset(flag.code for flag in flags)


def _count_clamped(found: Rates, surgery: Surgery, rng: np.random.Generator) -> None:
    """Count a marker that was clamped again while the cart moved, and the spine did not, settled, or was corrected."""
    again = str(rng.choice([level for level in surgery.marked if level != surgery.reference]))
    middle = convergence_point(large_rig())
    still = moved_cart(surgery.bodies[BASELINE], *random_cart_motion(rng, CartMotion()), middle)
    n = len(LEVELS)
    settled = SpinePoses(
        still.position_mm + SETTLING_MM * rng.standard_normal((n, 3)),
        rotation_from_vector(np.radians(SETTLING_DEG) * rng.standard_normal((n, 3))) @ still.rotation,
    )
    tilts = [tilts_of(surgery.truth(stage).rotation)[0][LEVELS.index(again)] for stage in (BASELINE, INTER)]
    lost = abs(tilts[1] - tilts[0]) > LOST_DEG
    for name, bodies in (("still", still), ("settled", settled), ("moved", surgery.bodies[INTER])):
        now = {BASELINE: surgery.triads[BASELINE], INTER: triads_on(bodies, surgery.mounts)}
        (stages,) = measured_stages([replace(surgery, triads=now)], rng)
        common = stages[BASELINE].keys() & stages[INTER].keys()
        if not {again, surgery.reference} <= common or len(common) < 3:
            continue
        setup = replace(surgery.exact_setup(), rebaselines=(Rebaseline(again, BASELINE, INTER),))
        seen = any(flag.code == "rebaseline-moved" for flag in rebaseline_flags(setup, stages, INTER))
        for key in (name, "lost") if name == "moved" and lost else (name,):
            found.clamped[key] += 1
            found.clamped_seen[key] += seen


def grids_and_bars(found: Rates) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the tables of what is seen, and the bars."""
    names = ("", *REVERSALS, OTHER, *SCALES)
    rows = [(name or "sound", *_shares(found, name)) for name in names]
    columns = [
        "initial poses",
        *(f"{what}, {size} curve" for what in ("poses", "tilts") for size in found.setups),
    ]
    of_clamped = [
        (name, count, f"{100 * found.clamped_seen[name] / count:.1f}%")
        for name, count in found.clamped.items()
    ]
    grids = [
        Grid.of("Initial poses: flagged or refused, %", columns, rows),
        Grid.of("Markers clamped again: flagged", ["spine", "n", "flagged"], of_clamped),
    ]
    return grids, tuple(_bars(found))


def _shares(found: Rates, name: str) -> Iterator[str]:
    for counts in (found.poses, found.tilts):
        for size, setups in found.setups.items():
            yield f"{100 * counts[size, name] / setups:.1f} of {setups}"


def _bars(found: Rates) -> Iterator[Bar]:
    everyone = sum(found.setups.values())
    for what, counts in (("poses", found.poses), ("tilts", found.tilts)):
        alarms = 100 * sum(counts[size, ""] for size in found.setups) / everyone
        yield Bar(
            f"sound initial poses: at most 0.5% are flagged for {what}", f"{alarms:.2f}%", alarms <= 0.5
        )
    seen: Sequence[tuple[Counter[tuple[Size, str]], str, float]] = (
        (found.poses, "left and right", 60),
        (found.poses, "both", 85),
        (found.tilts, "coronal tilts 0", 75),
    )
    for counts, name, least in seen:
        share = 100 * counts["large", name] / max(found.setups["large"], 1)
        yield Bar(f"{name}, large curve: seen in {least:g}%", f"{share:.0f}%", share >= least)
    for name in ("still", "settled"):
        alarms = 100 * found.clamped_seen[name] / max(found.clamped[name], 1)
        yield Bar(
            f"marker clamped again, spine {name}: at most 0.5% are flagged", f"{alarms:.2f}%", alarms <= 0.5
        )
    share = 100 * found.clamped_seen["lost"] / max(found.clamped["lost"], 1)
    yield Bar(f"a motion of {LOST_DEG:g} degrees is lost: seen in 80%", f"{share:.0f}%", share >= 80)
