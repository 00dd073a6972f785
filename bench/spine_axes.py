"""Patient axes that err: whether intervals hold the truth, and how often checks see it, on simulated surgeries."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from bench.spine_coverage import Coverage, coverage, grids_and_bars
from bench.spine_surgeries import BASELINE, Surgery, simulated_surgery
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, ScoliosisParameters
from spinewatch.spine.axes_checks import patient_axes_flags
from spinewatch.spine.configuration import SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.patient_axes import require_axes_of_triads

AXES_SD_DEG = 3.0
"""Deviation of the axes about each of them, which setups have unless they state another."""

POSES_SD = (2.0, 3.0)
"""Deviations of the initial poses that setups have unless they state others, mm and degrees."""

Given = Literal["object axes", "patient axes", "object axes, angles"]
GIVEN: tuple[Given, ...] = ("object axes", "patient axes", "object axes, angles")
"""How initial poses are given."""

TURNS: Mapping[str, tuple[float, float, float]] = {
    f"{angle} deg about {axis}": tuple(float(angle) * (axis == each) for each in "xyz")  # type: ignore[misc]
    for axis in "xyz"
    for angle in (20, 30)
}
"""Mistakes of the axes, degrees."""


@dataclass
class Rates:
    """How many setups were flagged or refused, by how poses were given and by what the axes were turned."""

    setups: Counter[Given] = field(default_factory=Counter)
    flagged: Counter[tuple[Given, str]] = field(default_factory=Counter)
    refused: Counter[tuple[Given, str]] = field(default_factory=Counter)


def rates(count: int, seed: int = 12) -> Rates:
    """Return the rates on ``count`` surgeries whose initial poses are those of the vertebrae between the markers."""
    found = Rates()
    rng = np.random.default_rng([seed, 3])
    for number in range(count):
        surgery = simulated_surgery(
            rng,
            list(CurveKind)[number % len(CurveKind)],
            ("ends and apices", "ends, apices and L5")[number % 2],
            extra=((), ("T1", "T10", "L1"))[number // 2 % 2],
            parameters=ScoliosisParameters(irregularity_sd_deg=2.0),
        )
        wrong = rotation_from_vector(np.radians(AXES_SD_DEG) * rng.standard_normal(3))
        for given in GIVEN:
            found.setups[given] += 1
            for name, turn in ({"": (0.0, 0.0, 0.0)} | dict(TURNS)).items():
                sign = 1 if number % 4 < 2 else -1
                turned = rotation_from_vector(np.radians(sign * np.array(turn))) @ wrong
                answer = _answer(surgery, given, turned, np.random.default_rng([seed, number]))
                found.flagged[given, name] += answer == "flagged"
                found.refused[given, name] += answer == "refused"
    return found


def _answer(surgery: Surgery, given: Given, turn: Float, rng: np.random.Generator) -> str:
    """Return ``refused``, ``flagged`` or nothing for a setup with axes that are turned against the patient's."""
    triads = surgery.triads[BASELINE]
    try:
        setup = _setup(surgery, given, turn, rng)
        require_axes_of_triads(setup.patient_axes, triads)
        return "flagged" if patient_axes_flags(setup, triads) else ""
    except ParameterError:
        return "refused"


def _setup(surgery: Surgery, given: Given, turn: Float, rng: np.random.Generator) -> SpineSetup:
    """Return a setup with initial poses that err, and axes turned against the patient's."""
    rows = slice(LEVELS.index(surgery.marked[0]), LEVELS.index(surgery.marked[-1]) + 1)
    axes = surgery.patient_axes @ turn
    own, bodies = surgery.truth(BASELINE), surgery.bodies[BASELINE]
    n = len(LEVELS[rows])
    shift = POSES_SD[0] * rng.standard_normal((n, 3))
    err = rotation_from_vector(np.radians(POSES_SD[1]) * rng.standard_normal((n, 3)))
    frame: Literal["object", "patient"] = "patient" if given == "patient axes" else "object"
    position = (own if frame == "patient" else bodies).position_mm[rows] + shift
    rotation = err @ (bodies if given == "object axes" else own).rotation[rows]
    if given == "object axes, angles":
        rotation = axes @ rotation
    initial = initial_from_poses(
        LEVELS[rows],
        position,
        rotation,
        *POSES_SD,
        frame=frame,
        patient_axes=axes,
        triads=surgery.triads[BASELINE],
        turned_with_axes=[given != "object axes"] * n,
    )
    return SpineSetup(
        axes, surgery.reference, BASELINE, initial, axes_covariance_deg2=AXES_SD_DEG**2 * np.eye(3)
    )


def parts(surgeries: int, setups: int) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the tables and bars of the intervals and of the checks."""
    held = coverage(surgeries, axes_sd_deg=AXES_SD_DEG, frames=("object", "patient"))
    grids, checks = grids_and_bars(_measured_only(held))
    own = f"patient axes that err by {AXES_SD_DEG:g} deg"
    grids = [replace(grid, title=f"{grid.title}; {own}") for grid in grids]
    checks = tuple(replace(bar, promise=f"{own}: {bar.promise}") for bar in checks)
    grid, of_checks = grid_and_bars_of_rates(rates(setups))
    return [*grids, grid], (*checks, *of_checks)


def _measured_only(found: Coverage) -> Coverage:
    """Return the tallies of values that are measured; the others are those of exact axes with wide intervals."""
    tallies = {key: tally for key, tally in found.tallies.items() if key[2] == "measured"}
    return replace(found, tallies=tallies)


def grid_and_bars_of_rates(found: Rates) -> tuple[Grid, tuple[Bar, ...]]:
    """Return the table of flagged and refused setups and its bars."""
    rows = list(_rows(found))
    checks = []
    for given, count in found.setups.items():
        alarms, refused = 100 * found.flagged[given, ""] / count, 100 * found.refused[given, ""] / count
        checks.append(
            Bar(
                f"sound axes, poses in {given}: at most 1% are flagged, and none is refused",
                f"{alarms:.1f}% and {refused:.1f}%",
                alarms <= 1 and refused == 0,
            )
        )
    for given, turn in (("object axes", "20 deg about z"), ("patient axes", "20 deg about x")):
        seen = found.flagged[given, turn] + found.refused[given, turn]
        share = 100 * seen / found.setups[given]
        checks.append(Bar(f"{turn}, poses in {given}: seen in 80%", f"{share:.0f}%", share >= 80))
    title = f"Patient axes that are wrong beside an error of {AXES_SD_DEG:g} deg: flagged + refused, %"
    return Grid.of(title, ["axes turned by", *found.setups], rows), tuple(checks)


def _rows(found: Rates) -> Iterator[tuple[str, ...]]:
    for name in ("", *TURNS):
        shares = (
            f"{100 * found.flagged[given, name] / count:.1f} + {100 * found.refused[given, name] / count:.1f}"
            for given, count in found.setups.items()
        )
        yield (name or "not at all", *shares)
