"""Chapter 4: similarity measures, templates, and DETECT-POINT beside the default method."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.balls import BallScene, BallView, find_ball_scenes
from bench.contenders import PUBLISHED, ROOTS, WHOLE_IMAGE, find_balls
from bench.selectivity import ROW_MEANS, TABLE_4_1, agreement, measure, selectivities
from bench.tables import Bar, Grid
from bench.thesis.printed import TABLE_4_4_FALSE, TABLE_4_4_PX
from spinewatch.arrays import Float
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.template_samples import tree_proximities
from spinewatch.imaging.frame import Frame
from spinewatch.thesis_1995.detect_point import DetectPointParameters, detect_point
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters, SegmentStatistic
from spinewatch.thesis_1995.template_trees import default_trees

BUDGETS = (20, 60)
REACH_PX = 1.5
ROW_MEAN_TOLERANCE = 0.015
EDGE_TOLERANCE = 0.12
"""Row means of the edges: three of the four classes of complete link have one to three of the 24 samples."""

VARIANTS = {
    "as published": PUBLISHED,
    "size reduction by means": replace(
        PUBLISHED, preprocessing=PreprocessingParameters(statistic=SegmentStatistic.MEAN)
    ),
    "whole image": WHOLE_IMAGE,
    "whole image, roots only (section 7.2)": ROOTS,
}


def part(directory: Path) -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the tables and bars of chapter 4."""
    scenes = list(find_ball_scenes(directory))
    responses = measure(scenes)
    gray = {m: float(np.mean([r.selectivity for r in responses[PropertySpace.GRAY, m]])) for m in Measure}
    best = max(gray, key=gray.__getitem__)
    printed_best = max(TABLE_4_1[PropertySpace.GRAY], key=TABLE_4_1[PropertySpace.GRAY].__getitem__)
    proximities, proximity_bars = _proximities()
    errors, error_bar = _table_4_4(scenes)
    recall, recall_bars = _recall(scenes)
    return [selectivities(responses, 2 * len(scenes)), agreement(responses), *proximities, errors, recall], [
        Bar("Table 4.1: RHO is the most selective measure on gray levels", best, best is printed_best),
        *proximity_bars,
        error_bar,
        *recall_bars,
    ]


def _proximities() -> tuple[list[Grid], list[Bar]]:
    grids, bars = [], []
    names = {
        PropertySpace.GRAY: ("Table 4.2", ROW_MEAN_TOLERANCE),
        PropertySpace.EDGE: ("Table 4.3", EDGE_TOLERANCE),
    }
    for space, tree in default_trees().trees.items():
        table, tolerance = names[space]
        means = tree_proximities(tree).mean(axis=0)
        ours, theirs = sorted(means[1:], reverse=True), sorted(ROW_MEANS[space][1:], reverse=True)
        rows = [
            ("thesis", f"{ROW_MEANS[space][0]:.3f}", *(f"{x:.3f}" for x in theirs)),
            ("here", f"{means[0]:.3f}", *(f"{x:.3f}" for x in ours)),
        ]
        columns = ["", "root", *(f"{k}." for k in range(1, len(means)))]
        grids.append(
            Grid.of(f"{table}: row means of the proximities, representatives in order", columns, rows)
        )
        off = max(abs(a - b) for a, b in zip((means[0], *ours), (ROW_MEANS[space][0], *theirs), strict=True))
        bars.append(Bar(f"{table} within {tolerance}", f"{off:.3f}", bool(off <= tolerance)))
    return grids, bars


def _table_4_4(scenes: Sequence[BallScene]) -> tuple[Grid, Bar]:
    """Compare detected features with true centres rounded to whole pixels, as those of the thesis were."""
    parameters = replace(WHOLE_IMAGE, expected_features=30)
    published, default, false = [], [], []
    for scene in scenes:
        ours = find_balls(scene)
        for view, detection in zip(scene.views, ours, strict=True):
            features = detect_point(Frame(view.image, view.side), view.ball_px, parameters).features.xy_px
            errors = _errors(view, features)
            published.append(errors)
            false.append(len(features) - len(errors))
            default.append(_errors(view, detection.features.xy_px[: 2 * len(view.centres_px)]))
    rows = []
    for name, values in (("DETECT-POINT here", published), ("default method", default)):
        errors = np.concatenate(values)
        lengths = np.linalg.norm(errors, axis=1)
        rows.append(
            (
                name,
                *(
                    f"{x:.2f}"
                    for x in (*errors.mean(axis=0), lengths.mean(), *errors.std(axis=0), lengths.std())
                ),
            )
        )
    rows.insert(0, ("thesis", *(f"{x:.2f}" for x in TABLE_4_4_PX)))
    grid = Grid.of(
        f"Table 4.4: errors, px; false features per image: thesis {TABLE_4_4_FALSE}, here {np.mean(false):.0f}",
        ["", "mean x", "mean y", "mean length", "sd x", "sd y", "sd length"],
        rows,
    )
    length = float(np.linalg.norm(np.concatenate(published), axis=1).mean())
    return grid, Bar(
        "Table 4.4: mean error at most that of the thesis, 0.96 px", f"{length:.2f} px", length <= 0.96
    )


def _errors(view: BallView, features_px: Float) -> Float:
    """Return the errors (k, 2) of the nearest features of visible balls within two and a half pixels."""
    centres = np.rint(view.centres_px[view.visible])
    if not len(features_px):
        return np.empty((0, 2))
    offset = centres[:, None] - features_px[None]
    nearest = np.linalg.norm(offset, axis=2).argmin(axis=1)
    errors = offset[np.arange(len(centres)), nearest]
    return np.asarray(errors[np.linalg.norm(errors, axis=1) <= 2.5])


def _recall(scenes: Sequence[BallScene]) -> tuple[Grid, list[Bar]]:
    rows, found = [], {}
    for name, parameters in VARIANTS.items():
        found[name] = [_share(scenes, replace(parameters, expected_features=budget)) for budget in BUDGETS]
        rows.append((name, *(f"{share:.3f}" for share in found[name]), f"{_kept(scenes, parameters):.2f}"))
    grid = Grid.of(
        f"DETECT-POINT: recall of balls within {REACH_PX} px over {2 * len(scenes)} images",
        ["variant", *(f"at {budget} features" for budget in BUDGETS), "balls in the searched rows"],
        rows,
    )
    whole = found["whole image"]
    return grid, [
        Bar("published detector, whole image: recall at 20 / 60 at least 0.635 / 0.829",
            " / ".join(f"{share:.3f}" for share in whole), whole[0] >= 0.635 and whole[1] >= 0.829),
    ]  # fmt: skip


def _views(scenes: Sequence[BallScene]) -> Iterator[BallView]:
    for scene in scenes:
        yield from scene.views


def _share(scenes: Sequence[BallScene], parameters: DetectPointParameters) -> float:
    hits = []
    for view in _views(scenes):
        result = detect_point(Frame(view.image, view.side), view.ball_px, parameters)
        features = result.features.xy_px[: parameters.expected_features]
        distance = np.linalg.norm(view.centres_px[view.visible][:, None] - features[None], axis=2)
        hits += list(distance.min(axis=1, initial=np.inf) < REACH_PX)
    return float(np.mean(hits))


def _kept(scenes: Sequence[BallScene], parameters: DetectPointParameters) -> float:
    """Return the share of visible balls in the rows that are searched."""
    kept = []
    for view in _views(scenes):
        first, last = detect_point(Frame(view.image, view.side), view.ball_px, parameters).preprocessed.rows
        v = view.centres_px[view.visible, 1]
        kept += list((v >= first) & (v < last))
    return float(np.mean(kept))
