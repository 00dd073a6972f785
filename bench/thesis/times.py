"""Section 7.2: times per image, by direct sums, by Fourier transforms, and with the roots only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import process_time

from bench.balls import find_ball_scenes
from bench.tables import Bar, Grid
from bench.thesis.printed import SAMPLES, TIMES_S
from spinewatch.arrays import Floating
from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure, Templates, similarity_spatial
from spinewatch.imaging.frame import Frame
from spinewatch.thesis_1995.detect_point import DetectPointParameters, detect_point
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters, preprocess
from spinewatch.thesis_1995.template_trees import default_trees

RUNS = 3

_MEASURES = {PropertySpace.GRAY: Measure.RHO, PropertySpace.EDGE: Measure.CCM}

Correlate = Callable[[Floating, Templates, Measure], Floating]


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the table of processor times per image, and the bars on their ratios."""
    view = next(find_ball_scenes(SAMPLES)).left
    frame = Frame(view.image, view.side)
    whole = PreprocessingParameters(statistic=None)
    image = preprocess(frame.gray(), whole)
    planes = {PropertySpace.GRAY: image.gray[None], PropertySpace.EDGE: image.edges[None]}
    trees = default_trees().scaled(view.ball_px).trees

    def correlate(by: Correlate, *, roots_only: bool) -> None:
        for space, tree in trees.items():
            for templates in (tree.roots,) if roots_only else (tree.roots, tree.representatives):
                by(planes[space], Templates(templates, tree.mask), _MEASURES[space])

    parameters = DetectPointParameters(preprocessing=whole)
    direct = _seconds(lambda: correlate(similarity_spatial, roots_only=False))
    transforms = _seconds(lambda: correlate(similarity, roots_only=False))
    roots = _seconds(lambda: correlate(similarity, roots_only=True))
    published = _seconds(lambda: detect_point(frame, view.ball_px, parameters))
    relaxed = _seconds(lambda: detect_point(frame, view.ball_px, replace(parameters, root_threshold=None)))
    printed = [f"{value:.0f}" for value in TIMES_S.values()]
    rows = [
        ("correlation by direct sums", printed[0], f"{direct:.3f}", "1", "1"),
        (
            "by Fourier transforms",
            f"{printed[1]} expected",
            f"{transforms:.3f}",
            "10",
            f"{direct / transforms:.1f}",
        ),
        (
            "roots only, by Fourier transforms",
            f"{printed[2]} expected",
            f"{roots:.3f}",
            "48",
            f"{direct / roots:.1f}",
        ),
        ("all of DETECT-POINT", "", f"{published:.3f}", "", ""),
        ("all of it, roots only", "", f"{relaxed:.3f}", "", ""),
    ]
    grid = Grid.of(
        "Section 7.2: seconds per image of 568 x 416, processor time. Direct sums are matrix products of a linear"
        " algebra library here, so that Fourier transforms gain less",
        ["", "thesis s", "here s", "gain in the thesis", "gain here"],
        rows,
    )
    bars = [
        Bar(
            "Fourier transforms are faster than direct sums",
            f"{direct / transforms:.1f} times",
            transforms < direct,
        ),
        Bar(
            "roots only: faster; 4 to 6 times expected, but the transforms of the image are shared",
            f"{transforms / roots:.1f} times",
            2 * roots < transforms,
        ),
    ]
    return [grid], bars


def _seconds(run: Callable[[], object]) -> float:
    """Return the least processor time of a few runs."""
    times = []
    for _ in range(RUNS):
        start = process_time()
        run()
        times.append(process_time() - start)
    return min(times)
