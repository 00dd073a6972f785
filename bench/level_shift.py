"""``python -m bench.level_shift``: initial vertebrae named rightly and a level off, on simulated surgeries.

The initial configuration comes from digitized radiographs or from poses that err by 2 mm and 3 degrees, of the
vertebrae from the first to the last marker and of one beyond each end where there is one. The table tells how often
each flag is raised.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bench.spine_surgeries import BASELINE, Surgery, simulated_surgery
from bench.tables import Grid
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.levels import anatomical_sequence
from spinewatch.simulation.radiographs import FilmParameters, digitized, radiograph_scene
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, ScoliosisParameters
from spinewatch.spine.configuration import InitialSpine
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.level_shift import level_shift_flags
from spinewatch.spine.radiographs import initial_from_radiographs
from spinewatch.triads.pose import Pose

SHIFTS = (0, -1, 1)
POSES_SD = (2.0, 3.0)
HOLDERS_SD_MM = (0.0, 5.0, 8.0)
"""Deviations per axis that the holders of a surgery have in common beside their own of 5 mm."""

_SEQUENCE = anatomical_sequence(())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.level_shift", description=__doc__)
    parser.add_argument("--surgeries", type=int, default=300, help="number of simulated surgeries")
    options = parser.parse_args(arguments)
    rows = []
    for common_sd in HOLDERS_SD_MM:
        for given in ("radiographs", "poses in object axes", "poses in patient axes"):
            counts: Mapping[int, Counter[str]] = {shift: Counter() for shift in SHIFTS}
            for number in range(options.surgeries):
                surgery = _surgery(number, common_sd)
                for shift in SHIFTS:
                    counts[shift][_answer(surgery, given, shift, np.random.default_rng([5, number]))] += 1
            for shift in SHIFTS:
                found = counts[shift]
                name = "right" if not shift else f"{shift:+d} level"
                codes = ("initial-levels-shifted", "initial-far-from-triads", "refused", "none")
                rows.append([f"{common_sd:g}", given, name, *(found[code] for code in codes)])
    columns = ["holders, common sd, mm", "given", "names", "shifted", "far", "refused", "no flag"]
    Grid.of(f"{options.surgeries} simulated surgeries", columns, rows).print()
    return 0


def _surgery(number: int, common_sd: float) -> Surgery:
    rng = np.random.default_rng([4, number])
    surgery = simulated_surgery(
        rng,
        list(CurveKind)[number % len(CurveKind)],
        ("ends and apices", "ends, apices and L5")[number % 2],
        extra=((), ("T10", "L1"))[number // 2 % 2],
        parameters=ScoliosisParameters(irregularity_sd_deg=2.0),
    )
    common = common_sd * rng.standard_normal(3)
    bodies, triads = surgery.bodies[BASELINE], surgery.triads[BASELINE]
    moved = {
        name: Pose(
            pose.position_mm + bodies.rotation[LEVELS.index(name)] @ common, pose.rotation, pose.covariance
        )
        for name, pose in triads.items()
    }
    return replace(surgery, triads={**surgery.triads, BASELINE: moved})


def _answer(surgery: Surgery, given: str, shift: int, rng: np.random.Generator) -> str:
    triads = surgery.triads[BASELINE]
    first, last = (LEVELS.index(surgery.marked[k]) for k in (0, -1))
    rows = np.arange(max(first - 1, 0), min(last + 2, len(LEVELS)))
    if rows[0] + shift < 0 and shift < 0:
        rows = rows[1:]
    names = [_SEQUENCE[_SEQUENCE.index(LEVELS[row]) + shift] for row in rows]
    try:
        initial = _initial(surgery, given, names, rows, rng)
        flags = level_shift_flags(initial, triads, placed_by_triads=given == "poses in patient axes")
    except SpinewatchError:
        return "refused"
    return flags[0].code if flags else "none"


def _initial(
    surgery: Surgery, given: str, names: Sequence[str], rows: np.ndarray, rng: np.random.Generator
) -> InitialSpine:
    triads, axes = surgery.triads[BASELINE], surgery.patient_axes
    bodies = surgery.bodies[BASELINE]
    if given == "radiographs":
        films = FilmParameters()
        own = surgery.truth(BASELINE)
        place = RigidTransform(axes, bodies.position_mm[0] - axes @ own.position_mm[0])
        exact = radiograph_scene(names, own.position_mm[rows], own.rotation[rows], place, rng, films)
        seen = digitized(exact, 2.0, rng)
        return initial_from_radiographs(films.pa, films.lateral, seen.vertebrae, seen.common, 2.0)[0]
    frame = "patient" if given == "poses in patient axes" else "object"
    source = surgery.truth(BASELINE) if frame == "patient" else bodies
    n = len(rows)
    shift = POSES_SD[0] * rng.standard_normal((n, 3))
    turn = rotation_from_vector(np.radians(POSES_SD[1]) * rng.standard_normal((n, 3)))
    return initial_from_poses(
        names,
        source.position_mm[rows] + shift,
        turn @ source.rotation[rows],
        *POSES_SD,
        frame=frame,  # type: ignore[arg-type]
        patient_axes=axes,
        triads=triads,
    )


if __name__ == "__main__":
    sys.exit(main())
