"""Tables that ``spinewatch plan`` prints."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from spinewatch.planning.accuracy import ExpectedAccuracy
    from spinewatch.planning.control_field_trial import ControlFieldTrial
    from spinewatch.planning.disparity import DisparityGrid


def print_accuracy(expected: ExpectedAccuracy, sigma_px: float) -> None:
    """Print standard deviations per vertebra and of the Cobb angle, and the marker."""
    table = Table("", "x mm", "y mm", "z mm", "in plane°", "out of plane°", "motion mm", "motion°", "in view")
    for triad in expected.triads:
        table.add_row(
            triad.vertebra,
            *_numbers([*triad.position_sd_mm, triad.in_plane_sd_deg, triad.out_of_plane_sd_deg]),
            " ".join(_numbers(triad.motion_sd_mm)),
            " ".join(_numbers(triad.motion_sd_deg)),
            "yes" if triad.in_view else "NO",
        )
    console = _console()
    console.print(table)
    first, last = expected.triads[0].vertebra, expected.triads[-1].vertebra
    console.print(
        f"Standard deviations for centres of {sigma_px:g} px; motion: between two stages, relative to {first}"
    )
    console.print(f"Cobb angle {first} to {last}: {expected.cobb_sd_deg:.2f} degrees at one stage")
    model = expected.model
    balls = "; ".join(
        f"{name} ({x:.1f}, {y:.1f})"
        for name, (x, y, _) in zip(model.balls, model.coordinates_mm, strict=True)
    )
    distances = ", ".join(f"{distance:.1f}" for distance in model.distances_mm)
    console.print(f"Marker {model.name}: {balls}; distances {distances} mm")


def print_control_field_trial(trial: ControlFieldTrial, trials: int) -> None:
    """Print the mean accuracy of simulated calibrations, and the errors of those that failed."""
    table = Table("standard deviation of control points", "x mm", "y mm", "z mm")
    table.add_row("shot used for calibration", *_numbers(trial.calibration_sd_mm, 3))
    table.add_row("shot used for verification", *_numbers(trial.verification_sd_mm, 3))
    console = _console()
    console.print(table)
    console.print(f"{len(trial.ids)} points are visible in both images: {', '.join(trial.ids)}")
    console.print(f"{trials - len(trial.error_codes)} of {trials} calibrations converged")
    for code, count in Counter(trial.error_codes).items():
        console.print(f"{count} failed: {code}")


def print_disparity(grid: DisparityGrid) -> None:
    """Print the distribution of the disparity per plane, and its bounds."""
    table = Table("z mm", "u mean px", "u sd px", "v mean px", "v sd px")
    for z, mean, sd in zip(grid.z_mm, *grid.distribution(), strict=True):
        table.add_row(*_numbers([z, mean[0], sd[0], mean[1], sd[1]], 1))
    console = _console()
    console.print(table)
    (u_min, u_max), (v_min, v_max) = grid.bounds_px()
    console.print(f"Disparity u {u_min:.1f} to {u_max:.1f} px, v {v_min:.1f} to {v_max:.1f} px")


def _numbers(values: Iterable[float], decimals: int = 2) -> list[str]:
    return ["-" if math.isnan(value) else f"{value:.{decimals}f}" for value in values]


def _console() -> Console:
    return Console() if Console().is_terminal else Console(width=110)
