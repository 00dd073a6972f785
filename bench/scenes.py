"""``python -m bench.scenes DIR``: measure every rendered pair under DIR and compare with its truth.

One row per pair: for each triad in label order the error of P in mm and of the rotation in degrees; ``-`` not
found, ``L`` with another label or none, ``*`` not all six ball images visible. ``--check`` ends with status 1
when a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from bench.scoring import Match, StageScore, failed_stage, score_motion, score_stage, summary
from bench.tables import Bar, Grid, bars
from bench.truth import Scene, find_scenes, read_frames, read_surgery
from commands.shared.stopwatch import Stopwatch
from spinewatch.errors import SpinewatchError
from spinewatch.pipeline import StageMeasurer, StageRequest


@dataclass(frozen=True, eq=False)
class Outcome:
    """Score of each pair, and figures of all pairs and of those of each folder, by name."""

    root: Path
    scores: tuple[StageScore, ...]
    figures: Mapping[str, dict[str, Any]]

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars over all pairs."""
        figures = self.figures["all"]
        complete = {
            folder.name: all(match.found for score in stages.values() for match in score.matches)
            for folder, stages in _surgeries(self.scores).items()
        }
        return (
            Bar("visible triads found >= 80%", f"{figures['found_pct']:.1f}%", figures["found_pct"] >= 80),
            Bar("false triads <= 2", str(figures["false"]), figures["false"] <= 2),
            *(
                Bar(f"surgery {name} complete in all stages", "yes" if whole else "no", whole)
                for name, whole in complete.items()
            ),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        return self._pairs(), self._summary(), self._uncertainty(), bars(self.bars)

    def _pairs(self) -> Grid:
        columns = ["pair", "exposure", "triads mm/deg", "false", "features", "ms", "flags"]
        rows = (
            [
                score.scene.folder.relative_to(self.root),
                score.scene.exposure,
                score.failure or "  ".join(_cell(match) for match in score.matches),
                score.false,
                "/".join(map(str, score.feature_counts)),
                f"{score.total_ms:.0f}",
                " ".join(score.flags),
            ]
            for score in self.scores
        )
        return Grid.of("Pairs (* not all six ball images visible)", columns, rows)

    def _summary(self) -> Grid:
        names = [name for name in self.figures["all"] if name != "uncertainty"]
        rows = ([name, *(_text(figures[name]) for figures in self.figures.values())] for name in names)
        return Grid.of("Summary", ["figure", *self.figures], rows)

    def _uncertainty(self) -> Grid:
        columns = ["error of", "n", "mean chi2/3", "median ratio", "within the 95% region"]
        rows = (
            (name, f"{u['n']:.0f}", f"{u['mean']:.2f}", f"{u['median']:.2f}", f"{u['within95_pct']:.0f}%")
            for name, u in self.figures["all"]["uncertainty"].items()
        )
        return Grid.of(
            "Stated uncertainty against the truth (1 is right, above 1 is too small)", columns, rows
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.scenes", description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args(arguments)
    outcome = measure(options.directory)
    if not outcome.scores:
        parser.error(f"no truth.json with triads under {options.directory}")
    for grid in outcome.grids:
        grid.print()
    if options.json:
        options.json.write_text(json.dumps(_plain(outcome.figures), indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def measure(root: Path) -> Outcome:
    """Measure and score every pair under a folder."""
    scores = tuple(measure_scene(scene) for scene in find_scenes(root))
    folders = groupby(scores, key=lambda score: score.scene.folder.relative_to(root).parts[0])
    parts = {"all": scores, **{name: tuple(group) for name, group in folders}}
    if len(parts) == 2:  # a single folder is the same as all
        parts = {"all": scores}
    return Outcome(root, scores, {name: _figures(part) for name, part in parts.items()})


def measure_scene(scene: Scene) -> StageScore:
    """Measure one pair as ``spinewatch process`` does, and score it."""
    request = StageRequest(labels=scene.labels, spine_axis=scene.spine_axis, triads=len(scene.labels))
    clock = Stopwatch()
    clock("decode")
    try:
        frames = read_frames(scene.folder)
        with ThreadPoolExecutor(max_workers=1) as pool:
            measurement = StageMeasurer(scene.rig, pool=pool).measure(*frames, request, progress=clock)
    except SpinewatchError as error:
        return failed_stage(scene, str(error))
    return score_stage(scene, measurement, clock.stop()["total"])


def _figures(scores: Sequence[StageScore]) -> dict[str, Any]:
    motions = [
        error
        for folder, stages in _surgeries(scores).items()
        if (surgery := read_surgery(folder)) is not None
        for error in score_motion(stages, surgery)
    ]
    return summary(scores, motions)


def _surgeries(scores: Sequence[StageScore]) -> dict[Path, dict[str, StageScore]]:
    groups = groupby(scores, key=lambda score: score.scene.folder.parent)
    stages = {folder: {score.scene.folder.name: score for score in group} for folder, group in groups}
    return {folder: found for folder, found in stages.items() if read_surgery(folder) is not None}


def _cell(match: Match) -> str:
    hidden = "" if match.truth.visible else "*"
    if match.measured is None:
        return "-" + hidden
    if not match.labelled_correctly:
        return "L" + hidden
    return f"{match.position_error_mm:.1f}/{np.linalg.norm(match.rotation_error_deg):.1f}{hidden}"


def _text(value: object) -> str:
    if isinstance(value, dict):
        return "   ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.3f}"
    return str(value)


def _plain(value: Any) -> Any:
    """Return figures with None instead of NaN, which JSON does not have."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and np.isnan(value) else value


if __name__ == "__main__":
    sys.exit(main())
