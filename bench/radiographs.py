"""``python -m bench.radiographs``: initial configurations from simulated radiographs against their stated deviations.

Each pair of radiographs shows another scoliotic spine; landmarks are digitized with an error, and eight common points
have an error in object space. Errors are in the axes of the patient: x anterior, y left, z cephalad. Rotations about x
are coronal tilts, about y sagittal tilts and about z axial rotations. ``--check`` ends with status 1 when a bar is
missed.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.tables import Bar, Grid, bars
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.radiographs import FilmParameters, digitized, radiograph_scene
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, random_scoliosis
from spinewatch.simulation.spines import random_rotation
from spinewatch.spine.radiographs import initial_from_radiographs

_AXES = (
    *("position, anterior", "position, left", "position, cephalad"),
    *("coronal tilt", "sagittal tilt", "axial rotation"),
)
_UNITS = ("mm",) * 3 + ("deg",) * 3


@dataclass(frozen=True)
class Trials:
    """Errors of many pairs of radiographs.

    Attributes
    ----------
    errors
        Truth minus result, shape (pairs, levels, 6), mm and degrees.
    deviations
        Stated standard deviations, the same shape.
    chi2
        Squared errors of each pose weighted by their covariance, shape (pairs, levels), of 6 degrees of freedom.
    scale_errors
        Errors of the scale over their stated deviation, shape (pairs,).
    flags
        Number of pairs with each flag.
    """

    errors: Float
    deviations: Float
    chi2: Float
    scale_errors: Float
    flags: Counter[str]


def trials(count: int, sd_px: float) -> Trials:
    """Return the errors of ``count`` pairs whose landmarks have the deviation ``sd_px``."""
    films = FilmParameters()
    errors, deviations, chi2, scales = [], [], [], []
    flags: Counter[str] = Counter()
    for seed in range(count):
        rng = np.random.default_rng([13, seed])
        poses = random_scoliosis(rng, list(CurveKind)[seed % len(CurveKind)]).poses
        patient = RigidTransform(random_rotation(rng, 180.0), rng.uniform(-500, 500, 3))
        exact = radiograph_scene(LEVELS, poses.position_mm, poses.rotation, patient, rng, films)
        seen = digitized(exact, sd_px, rng)
        initial, fit = initial_from_radiographs(films.pa, films.lateral, seen.vertebrae, seen.common, sd_px)
        flags.update({flag.code for flag in fit.flags})
        R = patient.rotation
        turn = vector_from_rotation(exact.rotation @ np.swapaxes(initial.rotation, -1, -2))
        error = np.concatenate([(exact.position_mm - initial.position_mm) @ R, np.degrees(turn) @ R], axis=1)
        factor = np.kron(np.eye(2), R.T) @ initial.errors
        S = factor @ np.swapaxes(factor, -1, -2)
        errors.append(error)
        deviations.append(np.sqrt(np.diagonal(S, axis1=-2, axis2=-1)))
        chi2.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(S), error))
        scales.append((1 - fit.similarity.transform.scale) / fit.similarity.scale_sd)
    return Trials(np.array(errors), np.array(deviations), np.array(chi2), np.array(scales), flags)


def table(found: Trials, sd_px: float) -> Grid:
    """Return errors and stated deviations."""
    ratio = found.errors / found.deviations
    rows = (
        (
            f"{axis}, {unit}",
            f"{np.sqrt(np.mean(found.errors[..., k] ** 2)):.3f}",
            f"{np.sqrt(np.mean(found.deviations[..., k] ** 2)):.3f}",
            f"{np.mean(found.errors[..., k]):+.3f}",
            f"{100 * np.mean(np.abs(ratio[..., k]) < 1.96):.1f}",
        )
        for k, (axis, unit) in enumerate(zip(_AXES, _UNITS, strict=True))
    )
    title = f"{len(found.errors)} pairs of radiographs, {len(LEVELS)} levels, landmarks {sd_px:g} px (0.2 mm a pixel)"
    return Grid.of(title, ["", "RMS error", "stated deviation", "bias", "inside 95% interval, %"], rows)


def promised(found: Trials) -> list[Bar]:
    """Return the bars."""
    inside = 100 * (np.abs(found.errors) < 1.96 * found.deviations).mean(axis=(0, 1))
    chi2 = float(found.chi2.mean() / 6)
    scale = float(np.sqrt(np.mean(found.scale_errors**2)))
    flagged = ", ".join(f"{code} {count}" for code, count in found.flags.items()) or "none"
    return [
        Bar(
            "95% intervals cover 93-97% of every component",
            f"{inside.min():.1f} to {inside.max():.1f}%",
            bool(inside.min() >= 93 and inside.max() <= 97),
        ),
        Bar("chi-squared of a pose over 6: 0.9 to 1.1", f"{chi2:.3f}", 0.9 <= chi2 <= 1.1),
        Bar("error of the scale over its deviation: 0.85 to 1.15", f"{scale:.3f}", 0.85 <= scale <= 1.15),
        Bar(
            "flags raised by sound input: at most 2%",
            flagged,
            sum(found.flags.values()) <= 0.02 * len(found.errors),
        ),
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables; return 1 with ``--check`` when a bar is missed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pairs", type=int, default=200, help="number of simulated pairs")
    parser.add_argument("--sd-px", type=float, default=2.0, help="standard deviation of a landmark, px")
    parser.add_argument("--check", action="store_true", help="exit status 1 when a bar is missed")
    options = parser.parse_args(arguments)
    found = trials(options.pairs, options.sd_px)
    table(found, options.sd_px).print()
    checks = promised(found)
    bars(checks).print()
    return int(options.check and not all(bar.holds for bar in checks))


if __name__ == "__main__":
    sys.exit(main())
