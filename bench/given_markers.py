"""``python -m bench.given_markers``: markers given rightly and wrongly, on simulated stages of 2 to 6 triads.

The legs of the marker are random. The table tells how often the flag ``marker-doubtful`` is raised, how often only
missing triads or large residuals are told, and how often a wrong marker is quiet: poses, and none of these flags.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from bench.tables import Grid
from spinewatch.errors import ParameterError
from spinewatch.imaging.frame import SIDES
from spinewatch.markers import TriadModel, flat_triad, parse_marker
from spinewatch.simulation.observations import FeatureNoise, HiddenBall, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.marker_check import marker_flags
from spinewatch.triads.search import SearchParameters, match_triads
from spinewatch.triads.variance_factor import VarianceFactorParameters, variance_factor

STAGES = 300
_SEARCH, _VARIANCE = SearchParameters(), VarianceFactorParameters()
_RIG = large_rig()

Given = Callable[[float, float, float], str]

MISTAKES: tuple[tuple[str, Given], ...] = (
    ("MX,YY,XX", lambda x, y, m: f"flat:{m:g},{y:g},{x:g}"),
    ("XX,MX,YY", lambda x, y, m: f"flat:{x:g},{m:g},{y:g}"),
    ("YY,XX,MX", lambda x, y, m: f"flat:{y:g},{x:g},{m:g}"),
    ("YY,MX,XX", lambda x, y, m: f"flat:{y:g},{m:g},{x:g}"),
    ("MX,XX,YY", lambda x, y, m: f"flat:{m:g},{x:g},{y:g}"),
    ("twice the lengths", lambda x, y, m: f"flat:{2 * x:g},{2 * y:g},{2 * m:g}"),
    ("half the lengths", lambda x, y, m: f"flat:{x / 2:g},{y / 2:g},{m / 2:g}"),
    ("lengths in tenths of a mm", lambda x, y, m: f"flat:{10 * x:g},{10 * y:g},{10 * m:g}"),
    ("orthogonal for flat", lambda x, y, m: f"orthogonal:{x:g},{y:g},{m:g}"),
)


def main() -> int:
    """Run the benchmark; return the exit status."""
    rows = [
        _row("right, every ball in view", _stages(0.0), None),
        _row("right, a sixth of the ball images hidden", _stages(1 / 6), None),
        _row("right, a third of the ball images hidden", _stages(1 / 3), None),
        *(_row(name, _stages(0.0), given) for name, given in MISTAKES),
    ]
    columns = [
        "given",
        "stages",
        "refused",
        "marker-doubtful",
        "triads told missing",
        "appearance-unusual",
        "quiet",
        "no triads and no number known",
    ]
    Grid.of("Markers given", columns, rows).print()
    return 0


def _row(
    name: str, stages: Iterator[tuple[tuple[float, float, float], Observation, int]], given: Given | None
) -> list[object]:
    counts: Counter[str] = Counter()
    for number, (legs, seen, count) in enumerate(stages):
        try:
            model = flat_triad(*legs) if given is None else parse_marker(given(*legs))
        except ParameterError:
            counts["refused"] += 1
            continue
        counts[_answer(model, seen, count if number % 2 else None)] += 1
    return [
        name,
        STAGES,
        *(counts[key] for key in ("refused", "doubtful", "missing", "misfit", "quiet", "nothing")),
    ]


def _answer(model: TriadModel, seen: Observation, expected: int | None) -> str:
    found = match_triads(seen.left, seen.right, _RIG, _SEARCH, expected=expected, axis="x", models=[model])
    factor = variance_factor(found.triads, _VARIANCE)
    pair = seen.left.enlarged(factor**0.5), seen.right.enlarged(factor**0.5)
    misfit = factor > _VARIANCE.max_usual
    if marker_flags(found.triads, pair, _RIG, _SEARCH, [model], expected=expected, axis="x", misfit=misfit):
        return "doubtful"
    codes = {flag.code for flag in found.flags}
    if codes & {"triad-count-low", "triad-incomplete", "triad-doubtful"}:
        return "missing"
    if not any(triad.pose is not None for triad in found.triads):
        return "nothing"
    return "misfit" if misfit else "quiet"


def _stages(hidden_share: float) -> Iterator[tuple[tuple[float, float, float], Observation, int]]:
    """Yield legs XX, YY, MX, mm, features, and the number of triads."""
    made = number = 0
    while made < STAGES:
        rng = np.random.default_rng([11, number])
        number += 1
        legs = tuple(float(leg) for leg in rng.permutation(rng.uniform(9, 26, 3)).round(1))
        try:
            model = flat_triad(*legs)
        except ParameterError:
            continue
        if model.distances_mm.min() < 12:
            continue
        made += 1
        count = int(rng.integers(2, 7))
        poses = random_spine(rng, count, spacing_mm=180 / count)
        hidden: list[HiddenBall] = [
            (ball, side) for ball in range(3 * count) for side in SIDES if rng.uniform() < hidden_share
        ]
        noise = FeatureNoise(0.1, false_features=int(rng.integers(4, 30)))
        seen = observe(_RIG, poses, rng, noise, hidden=hidden, models=[model] * count)
        yield (legs[0], legs[1], legs[2]), seen, count


if __name__ == "__main__":
    sys.exit(main())
