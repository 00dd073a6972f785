"""Section 7.2: colour cameras, simulated: black balls in wounds that are red, by one channel, and by three."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bench.tables import Bar, Grid
from bench.thesis.materials import GLOSSY
from bench.thesis.simulated_balls import Change, found, repainted, tissue_times, worlds
from spinewatch.simulation.images.world import World

COUNT = 960

CHANNELS = {"red": 2.2, "green": 0.5, "blue": 0.45}
"""Albedo of tissue and blood in a channel, of that in gray, which is 30% red, 59% green and 11% blue: oxygenated blood
absorbs green and blue."""


def _channel(name: str) -> Change:
    def change(world: World) -> World:
        return tissue_times(CHANNELS[name])(repainted(GLOSSY)(world))

    return change


PLANES: Mapping[str, Sequence[Change]] = {
    "gray": [repainted(GLOSSY)],
    "red channel, or a red filter": [_channel("red")],
    "green channel": [_channel("green")],
    "red, green and blue": [_channel(name) for name in CHANNELS],
}


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return how well balls are found in each plane, and the bars on them."""
    given = worlds(COUNT)
    results = {name: found(given, planes) for name, planes in PLANES.items()}
    gray, red, _, three = results.values()
    rows = [
        (name, f"{r.contrast:+.2f}", f"{r.recall:.0%}", f"{r.rms_px:.2f}", f"{r.seconds / gray.seconds:.1f}")
        for name, r in results.items()
    ]
    grid = Grid.of(
        f"Section 7.2: black balls in {COUNT} simulated wounds of 57 x 57 px, tissue {CHANNELS} of its gray albedo",
        ["planes", "contrast", "found", "centre px per axis", "time of gray"],
        rows,
    )
    return [grid], [
        Bar(
            "the red channel alone finds more balls than gray, at the same cost",
            f"{red.recall:.0%} against {gray.recall:.0%}",
            red.recall > gray.recall,
        ),
        Bar(
            "the red channel alone, or a red filter, gives most of what three channels give, in less time",
            f"gray {gray.recall:.0%}, red {red.recall:.0%}, three {three.recall:.0%},"
            f" {three.seconds / red.seconds:.1f} times the time",
            2 * (red.recall - gray.recall) > three.recall - gray.recall and three.seconds > red.seconds,
        ),
    ]
