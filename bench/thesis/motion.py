"""Chapter 6: Table 6.1 and the motions that follow from it, and the test that section 6.3 asks for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.spine_thesis import grids_and_bars, trials
from bench.tables import Bar, Grid
from bench.thesis.printed import printed
from spinewatch.spine.legacy_1995 import TriadRow, legacy_flags, legacy_motion

ANGLES_DEG = (1.64, 40.92, 22.02, 15.32)
DISPLACEMENTS_MM = (0.0, 14.25, 17.33, 23.93)
"""Rotations and displacements of L1, T11, T9 and T7, computed once by hand from the rows of Table 6.1."""

_TRIALS = 20


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the tables and bars of chapter 6."""
    before, after = (_rows(stage) for stage in ("Pre", "Post"))
    motions = legacy_motion(before, after)
    grid = Grid.of(
        "Table 6.1: motion of each triad by eq. 6.1",
        ["triad", "rotation deg", "displacement mm"],
        [(m.vertebra, f"{m.angle_deg:.2f}", f"{m.displacement_mm:.2f}") for m in motions],
    )
    angles = np.array([m.angle_deg for m in motions])
    displacements = np.array([m.displacement_mm for m in motions])
    off = max(np.abs(angles - ANGLES_DEG).max(), np.abs(displacements - DISPLACEMENTS_MM).max())
    flagged = {flag.detail.split(" ")[0] for flag in legacy_flags(before, after)}
    bars = [
        Bar("Table 6.1: rotations and displacements within 0.005", f"{off:.4f}", bool(off <= 0.005)),
        Bar("Table 6.1: T11 is flagged as implausible", f"{len(legacy_flags(before, after))} flags",
            all("T11" in flag.detail for flag in legacy_flags(before, after)) and bool(flagged)),
    ]  # fmt: skip
    grids, controlled = grids_and_bars(trials(_TRIALS))
    return [grid, *grids], [*bars, *controlled[:3]]


def _rows(stage: str) -> list[TriadRow]:
    return [
        TriadRow(row["vertebra"], np.array(row["position_mm"]), np.zeros(3), np.array(row["angles_deg"]), 0.0)
        for row in printed("table_6_1")
        if row["stage"] == stage
    ]
