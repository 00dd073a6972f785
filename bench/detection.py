"""``python -m bench.detection [DIR]``: ball detection on rendered scenes under DIR, beside its peers in the same run.

Recall counts the balls at least half visible that have a feature within 1.5 px among the first 20, 40, 60 and 100 of an
image. Centres are those after refinement. ``--check`` ends with status 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from statistics import median
from typing import Any

from bench.balls import find_ball_scenes
from bench.contenders import contenders
from bench.detection_cost import RUNS, SIZES, Cost, measure_cost
from bench.detection_scoring import BUDGETS, Centres, FoundScene, Score, centre_errors, centres, find, score
from bench.tables import Bar, Grid, bars
from spinewatch.imaging.frame import SIDES

SAMPLES = Path(__file__).parents[1] / "samples"
RECALL_AT = 60
RECALL = 0.97
CENTRE_PX = 0.15
CLEAN_PX = 0.03
BIAS_PX = 0.03
SURE_SHARE = 0.85
CHI2 = (0.7, 1.5)
FASTER = 15.0
FLAT = 1.25
MEMORY_MB = 64.0


@dataclass(frozen=True, eq=False)
class Outcome:
    """Scores of all contenders, Spinewatch first; its detections in the scenes and in clean images; its cost."""

    root: Path
    scores: Mapping[str, Score]
    scenes: tuple[FoundScene, ...]
    clean: tuple[FoundScene, ...]
    cost: Cost

    @property
    def centres(self) -> dict[str, Centres]:
        """Errors of the centres, by the name of the row."""
        errors = centre_errors(self.scenes)
        rows = {
            "both views": errors,
            "left": errors.of_side("left"),
            "right": errors.of_side("right"),
        }
        if self.clean:
            rows["clean, both views"] = centre_errors(self.clean)
        return {name: centres(found) for name, found in rows.items()}

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The requirements."""
        return (*_accuracy_bars(self), *_cost_bars(self.cost))

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        return (
            _contest(self.scores),
            _centre_table(self.centres),
            _scene_table(self.root, (*self.scenes, *self.clean)),
            *_cost_tables(self.cost),
            bars(self.bars),
        )

    @property
    def figures(self) -> dict[str, Any]:
        """The numbers, ready for JSON."""
        return {
            "recall": {
                name: dict(zip(map(str, BUDGETS), s.recall, strict=True)) for name, s in self.scores.items()
            },
            "ms_per_pair": {name: score.ms for name, score in self.scores.items()},
            "centres": {name: vars(row) for name, row in self.centres.items()},
            "cost": {
                "times_faster": self.cost.times_faster,
                "ns_per_pixel": {f"{w}x{h}": ns for (w, h), ns in self.cost.ns_per_pixel.items()},
                "memory_mb": self.cost.memory_mb,
            },
        }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.detection", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="?", default=SAMPLES)
    parser.add_argument("--markdown", action="store_true", help="print Markdown, for a document")
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of the timing")
    options = parser.parse_args(arguments)
    outcome = measure(options.directory, options.runs)
    if not outcome.scenes:
        parser.error(f"no truth.json with triads under {options.directory}")
    for grid in outcome.grids:
        print(grid.markdown()) if options.markdown else grid.print()
    if options.json:
        options.json.write_text(json.dumps(outcome.figures, indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def measure(root: Path, runs: int = RUNS) -> Outcome:
    """Run every contender on the scenes under a folder, and time Spinewatch."""
    scenes = tuple(find_ball_scenes(root))
    if not scenes:
        return Outcome(root, {}, (), (), Cost({}, (), float("nan")))
    found = tuple(map(find, scenes))
    fields = {
        view: detection.field
        for scene in found
        for view, detection in zip(scene.balls.views, scene.detections, strict=True)
    }
    return Outcome(
        root=root,
        scores={name: score(contender, scenes) for name, contender in contenders(fields).items()},
        scenes=found,
        clean=tuple(map(find, find_ball_scenes(root / "clean"))),
        cost=measure_cost(runs),
    )


def _accuracy_bars(outcome: Outcome) -> Iterable[Bar]:
    recall = outcome.scores["Spinewatch"].recall[BUDGETS.index(RECALL_AT)]
    rows = outcome.centres
    all_views, sides = rows["both views"], (rows["left"], rows["right"])
    bias = [abs(b) for side in sides for b in side.bias_px]
    low, high = CHI2
    outside = sum(_outside(scene) for scene in outcome.scenes)
    yield Bar(f"recall >= {RECALL} at {RECALL_AT} features", f"{recall:.3f}", recall >= RECALL)
    yield Bar(
        f"sure centres within {CENTRE_PX} px RMS per axis",
        _pair(all_views.rms_px),
        max(all_views.rms_px) <= CENTRE_PX,
    )
    yield Bar(
        f">= {SURE_SHARE:.0%} of clear balls are sure",
        f"{all_views.sure_share:.1%}",
        all_views.sure_share >= SURE_SHARE,
    )
    yield Bar(f"bias of each view and axis < {BIAS_PX} px", f"{max(bias):.3f}", max(bias) < BIAS_PX)
    yield Bar(
        f"chi-square per degree of freedom in {low}-{high}",
        f"{all_views.chi2:.2f}",
        low <= all_views.chi2 <= high,
    )
    if clean := rows.get("clean, both views"):
        yield Bar(
            f"clean images: within {CLEAN_PX} px RMS per axis",
            _pair(clean.rms_px),
            max(clean.rms_px) <= CLEAN_PX,
        )
    yield Bar("every ball is in the surgical field", f"{outside} outside", outside == 0)


def _cost_bars(cost: Cost) -> Iterable[Bar]:
    yield Bar(
        f"at least {FASTER:.0f} times faster than masked matching",
        f"{cost.times_faster:.1f} times",
        cost.times_faster >= FASTER,
    )
    yield Bar(f"cost per pixel grows at most {FLAT} times", f"{cost.growth:.2f} times", cost.growth <= FLAT)
    yield Bar(f"memory < {MEMORY_MB:.0f} MB", f"{cost.memory_mb:.0f} MB", cost.memory_mb < MEMORY_MB)


def _contest(scores: Mapping[str, Score]) -> Grid:
    columns = [
        "detector",
        *(f"recall at {n}" for n in BUDGETS),
        "features",
        "centre RMS u, v px",
        "ms per pair",
    ]
    rows = (
        [name, *(f"{r:.3f}" for r in s.recall), f"{s.features:.0f}", _pair(s.rms_px), f"{s.ms:.0f}"]
        for name, s in scores.items()
    )
    return Grid.of("Detectors (features and centres: of the list of 60)", columns, rows)


def _centre_table(rows: Mapping[str, Centres]) -> Grid:
    columns = ["", "balls", "sure balls", "sure of clear ones", "RMS u, v px", "bias u, v px", "chi2 / dof"]
    cells = (
        [
            name,
            c.clear,
            c.sure,
            f"{c.sure_share:.1%}",
            _pair(c.rms_px),
            _pair(c.bias_px, sign="+"),
            f"{c.chi2:.2f}",
        ]
        for name, c in rows.items()
    )
    title = "Centres of sure balls, those of less than 0.2 px stated (balls: more than 90% visible)"
    return Grid.of(title, columns, cells)


def _scene_table(root: Path, scenes: Iterable[FoundScene]) -> Grid:
    columns = [
        "scene",
        "exposure",
        "outside field",
        "field height px",
        "RMS u, v px",
        "bias left",
        "bias right",
    ]
    rows = []
    for found in scenes:
        errors = centre_errors([found])
        heights = "/".join(str(detection.field.height_px) for detection in found.detections)
        rows.append(
            [
                found.balls.scene.folder.relative_to(root),
                found.balls.scene.exposure,
                _outside(found),
                heights,
                _pair(centres(errors).rms_px),
                *(_pair(centres(errors.of_side(side)).bias_px, sign="+") for side in SIDES),
            ]
        )
    return Grid.of("Scenes: surgical field, and centres of sure balls", columns, rows)


def _cost_tables(cost: Cost) -> Iterable[Grid]:
    ours, peer = median(cost.ms[SIZES[0]]), median(cost.peer_ms)
    yield Grid.of(
        f"One pair of 568 x 416, {len(cost.peer_ms)} runs in turn",
        ["", "median ms", "times ours"],
        [
            ("Spinewatch, features and refined centres", f"{ours:.1f}", "1.0"),
            ("OpenCV, 10 masked matchTemplate per image", f"{peer:.1f}", f"{cost.times_faster:.1f}"),
        ],
    )
    rows = (
        [f"{w} x {h}", f"{median(cost.ms[w, h]):.1f}", f"{ns:.1f}"]
        for (w, h), ns in cost.ns_per_pixel.items()
    )
    yield Grid.of("Image size", ["pair of", "median ms", "ns per pixel"], rows)
    w, h = SIZES[-1]
    yield Grid.of(
        "Memory",
        ["", "MB"],
        [(f"peak resident memory above a loaded pair of {w} x {h}, new process", f"{cost.memory_mb:.0f}")],
    )


def _outside(found: FoundScene) -> int:
    """Return the number of balls that are visible at all but outside the field."""
    return sum(
        int((~detection.field.contains(view.centres_px[view.fraction > 0])).sum())
        for view, detection in zip(found.balls.views, found.detections, strict=True)
    )


def _pair(values: tuple[float, float], sign: str = "") -> str:
    return "-" if any(map(isnan, values)) else ", ".join(f"{value:{sign}.3f}" for value in values)


if __name__ == "__main__":
    sys.exit(main())
