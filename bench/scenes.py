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
from spinewatch.pipeline import StageMeasurer
from spinewatch.stage import StageRequest

MIN_TRIADS = 8
"""Smallest number of triads whose RMS errors are judged: their sampling error is about 15%."""

MIN_CENTRES = 40
"""Smallest number of centres whose RMS error is judged: the sampling error is about 11%."""

MIN_PAIRS = 8
"""Smallest number of pairs whose common shift is judged: the shift of one view varies by 0.1 px."""

MIN_REGIONS = 60
"""Smallest number of 95% regions whose coverage is judged: of 60, 57 ± 1.7 cover the truth."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Score of each pair, and figures of all pairs and of those of each folder, by name."""

    root: Path
    scores: tuple[StageScore, ...]
    figures: Mapping[str, dict[str, Any]]

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars over all pairs."""
        complete = {
            folder.name: all(match.found for score in stages.values() for match in score.matches)
            for folder, stages in _surgeries(self.scores).items()
        }
        return (
            *scene_bars(self.figures["all"]),
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


def scene_bars(figures: Mapping[str, Any]) -> tuple[Bar, ...]:
    """Return the bars of figures; those of statistics hold, and say so, where the sample is too small to judge them."""
    within, false = figures["within1mm_pct"], figures["false"]
    wrong = figures["mislabelled"] - figures["unlabelled"]
    triads, pairs = figures["found"], figures["pairs"]
    centres = sum(figures["sure_centres"].values())
    regions = [figures["uncertainty"][name] for name in ("P", "rotation")]
    n = int(sum(region["n"] for region in regions))
    covered = sum(r["n"] * r["within95_pct"] for r in regions if r["n"]) / max(n, 1)
    rms_px = max(value for side in figures["sure_rms_px"].values() for value in side)
    shift_px = max(abs(value) for side in figures["sure_bias_px"].values() for value in side)
    return (
        Bar("visible triads within 1 mm >= 95%", f"{within:.1f}%", within >= 95),
        Bar("false triads 0", str(false), false == 0),
        Bar("triads with a wrong label 0", str(wrong), wrong == 0),
        _judged(figures["P_rms_mm"], "P <= 0.25 mm RMS", "mm", 0.25, triads, MIN_TRIADS),
        _judged(figures["rot_rms_deg"], "rotation <= 1.3 degrees RMS", "degrees", 1.3, triads, MIN_TRIADS),
        _judged(rms_px, "sure centres <= 0.15 px RMS per axis", "px", 0.15, centres, MIN_CENTRES),
        _judged(shift_px, "common shift of sure centres <= 0.04 px", "px", 0.04, pairs, MIN_PAIRS),
        Bar(
            "95% regions of P and rotation cover 90 to 98%",
            f"{covered:.1f}% of {n}" + _too_few(n, MIN_REGIONS),
            n < MIN_REGIONS or 90 <= covered <= 98,
        ),
    )


def _judged(value: float, promise: str, unit: str, limit: float, n: int, min_n: int) -> Bar:
    return Bar(promise, f"{value:.3f} {unit}" + _too_few(n, min_n), n < min_n or value <= limit)


def _too_few(n: int, min_n: int) -> str:
    return f" (not judged: {n} of at least {min_n})" if n < min_n else ""


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
