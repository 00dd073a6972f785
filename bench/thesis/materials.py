"""Section 7.2: materials of the balls, simulated in the same random wounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bench.tables import Bar, Grid
from bench.thesis.simulated_balls import Change, found, repainted, tissue_times, worlds
from spinewatch.simulation.images.world import Material, World

COUNT = 240

GLOSSY = Material(albedo=0.03, roughness=0.06, f0=0.045, tail=0.5)
"""The hard, black plastic of the thesis."""
MATTE = Material(albedo=0.03, roughness=0.45, f0=0.04, tail=0.5)
CLOTH = Material(albedo=0.02, roughness=0.7, f0=0.005, tail=0.0)
FLUORESCENT = Material(albedo=1.3, roughness=0.45, f0=0.04, tail=0.5)
"""It reflects and emits more visible light than falls on it, since it converts ultraviolet too."""
LEAK = 0.02
"""Fraction of the lamp's light that a barrier filter lets through."""


def _filtered(world: World) -> World:
    """Return a world lit by ultraviolet light and seen through a barrier filter."""
    paint = Material(FLUORESCENT.albedo, FLUORESCENT.roughness, FLUORESCENT.f0 * LEAK, FLUORESCENT.tail)
    return tissue_times(LEAK)(repainted(paint)(world))


MATERIALS: Mapping[str, Change] = {
    "black, glossy (thesis)": repainted(GLOSSY),
    "black, matte": repainted(MATTE),
    "black, like dull cloth": repainted(CLOTH),
    "fluorescent": repainted(FLUORESCENT),
    "fluorescent, ultraviolet lamp and filter": _filtered,
}


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return how well balls of each material are found, and the bars on them."""
    given = worlds(COUNT)
    results = {name: found(given, [change]) for name, change in MATERIALS.items()}
    rows = [(name, f"{r.contrast:+.2f}", f"{r.recall:.0%}", f"{r.rms_px:.2f}") for name, r in results.items()]
    grid = Grid.of(
        f"Section 7.2: balls of other materials in {COUNT} simulated wounds of 57 x 57 px, found by the average of"
        " samples (RHO)",
        ["material", "contrast", "found", "centre px per axis"],
        rows,
    )
    glossy, matte, cloth, _, filtered = results.values()
    return [grid], [
        Bar(
            "dull cloth is found more often than glossy plastic (the wish of section 7.2)",
            f"{cloth.recall:.0%} against {glossy.recall:.0%}; matte paint {matte.recall:.0%}",
            cloth.recall > glossy.recall,
        ),
        Bar(
            "fluorescent balls behind a filter are found most often",
            f"{filtered.recall:.0%}",
            filtered.recall >= max(r.recall for r in results.values()),
        ),
    ]
