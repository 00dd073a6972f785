"""``python -m bench.selectivity [DIR]``: the thesis's Tables 4.1 to 4.3 on rendered scenes under DIR.

Selectivity (eq. 4.17) is the mean of a decision space, scaled to 0-255 within the surgical field, at the balls less its
mean over patches of 50 x 50 background pixels. As in the thesis the template is the average of the balls of another
image: here of the same side in the next scene.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.balls import BallScene, BallView, find_ball_scenes
from bench.tables import Grid
from spinewatch.arrays import Float, Single
from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.property_spaces import PropertySpace, property_planes
from spinewatch.detection.candidates.search import DetectionParameters, detect
from spinewatch.detection.candidates.similarity import Measure, Templates
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.candidates.template_building import BuildParameters
from spinewatch.detection.candidates.template_samples import cut_samples, round_mask, tree_proximities
from spinewatch.detection.candidates.templates import HALF, TemplateSet, default_template_set
from spinewatch.imaging.exposure import correct_exposure
from spinewatch.imaging.filters import truncated_median_filter
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.tone import log_tone, to_gray

SAMPLES = Path(__file__).parents[1] / "samples"
PATCH = 50

TABLE_4_1: Mapping[PropertySpace, Mapping[Measure, float]] = {
    PropertySpace.GRAY: dict(zip(Measure, (15, 40, 12, 44, 81), strict=True)),
    PropertySpace.EDGE: dict(zip(Measure, (29, 17, 14, 60, 72), strict=True)),
}
ROW_MEANS = {
    PropertySpace.GRAY: (0.9893, 0.9673, 0.9836, 0.9711, 0.9748, 0.9830, 0.9831),
    PropertySpace.EDGE: (0.9727, 0.9261, 0.9486, 0.9356, 0.9475),
}
"""Row averages of Tables 4.2 and 4.3, the root's first."""


@dataclass(frozen=True, eq=False)
class Response:
    """Selectivity of one image, and the same over the standard deviation of the background."""

    selectivity: float
    contrast: float


Key = tuple[PropertySpace, Measure]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.selectivity", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="?", default=SAMPLES)
    parser.add_argument("--markdown", action="store_true", help="print Markdown, for a document")
    options = parser.parse_args(arguments)
    scenes = list(find_ball_scenes(options.directory))
    if len(scenes) < 2:
        parser.error(f"selectivity needs two scenes, there are {len(scenes)} under {options.directory}")
    responses = measure(scenes)
    images = 2 * len(scenes)
    for grid in (
        selectivities(responses, images),
        agreement(responses),
        *_proximities(default_template_set()),
    ):
        print(grid.markdown()) if options.markdown else grid.print()
    return 0


def measure(scenes: Sequence[BallScene]) -> dict[Key, tuple[Response, ...]]:
    """Return the responses of all images, by property space and measure."""
    found: dict[Key, list[Response]] = {(s, m): [] for s in PropertySpace for m in Measure}
    for scene, other in zip(scenes, [*scenes[1:], scenes[0]], strict=True):
        for view, example in zip(scene.views, other.views, strict=True):
            field = detect(Frame(view.image, view.side), view.ball_px, DetectionParameters()).field
            for space in PropertySpace:
                for m, response in _responses(view, example, space, field):
                    found[space, m].append(response)
    return {key: tuple(values) for key, values in found.items()}


def background(field: SurgicalField, centres_px: Float) -> list[tuple[int, int]]:
    """Return the first pixels (u, v) of those patches of a grid in the field that no ball (n, 2) is near to.

    Balls are farther from their pixels than the half size of a template.
    """
    corners = [
        (u, v)
        for v in range(field.v0, field.v1 - PATCH + 1, PATCH)
        for u in range(field.u0, field.u1 - PATCH + 1, PATCH)
    ]
    reach = PATCH / 2 + HALF
    middle = (PATCH - 1) / 2
    return [
        corner
        for corner in corners
        if not (np.abs(centres_px - (np.array(corner) + middle)).max(axis=1) < reach).any()
    ]


def _responses(
    view: BallView, example: BallView, space: PropertySpace, field: SurgicalField
) -> Iterator[tuple[Measure, Response]]:
    """Yield the response of every measure in an image to the average ball of another."""
    size = view.ball_px
    scale = (size[0] / example.ball_px[0], size[1] / example.ball_px[1])
    balls = [(float(u), float(v)) for u, v in example.centres_px[example.visible]]
    average = cut_samples(_planes(example, space), balls, scale).mean(axis=0, keepdims=True)
    template = Templates(average, round_mask(size, BuildParameters().mask_radii))
    box = np.s_[field.v0 : field.v1, field.u0 : field.u1]
    planes = _planes(view, space)[:, box[0], box[1]]
    visible = view.centres_px[view.visible]
    u, v = (np.rint(visible[field.contains(visible)]).astype(int) - (field.u0, field.v0)).T
    corners = background(field, view.centres_px)
    for m in Measure:
        space_255 = _scaled(similarity(planes, template, m)[0], m)
        ground = np.concatenate(
            [space_255[b - field.v0 :, a - field.u0 :][:PATCH, :PATCH].ravel() for a, b in corners]
        )
        gain = float(space_255[v, u].mean() - ground.mean())
        yield m, Response(gain, gain / float(ground.std()))


def _planes(view: BallView, space: PropertySpace) -> Single:
    """Return the property planes of a whole image as detection makes them."""
    parameters = DetectionParameters()
    gray, _ = correct_exposure(to_gray(view.image), parameters.exposure)
    if space is PropertySpace.DIRECTIVITY:
        return property_planes(log_tone(gray, parameters.log_offset, 0.0), space)
    return property_planes(truncated_median_filter(gray), space)


def _scaled(values: NDArray[np.floating], measure: Measure) -> NDArray[np.floating]:
    low, high = float(values.min()), float(values.max())
    scaled = 255 * (values - low) / max(high - low, 1e-12)
    return np.asarray(255 - scaled if measure is Measure.ED else scaled)


def _means(responses: Mapping[Key, Sequence[Response]], space: PropertySpace) -> dict[Measure, float]:
    return {m: float(np.mean([r.selectivity for r in responses[space, m]])) for m in Measure}


def selectivities(responses: Mapping[Key, Sequence[Response]], images: int) -> Grid:
    """Return Table 4.1 beside ours."""
    rows: list[list[str]] = []
    for space in PropertySpace:
        if space in TABLE_4_1:
            rows.append([f"{space}, thesis", *(f"{TABLE_4_1[space][m]:.0f}" for m in Measure)])
        values = {m: [r.selectivity for r in responses[space, m]] for m in Measure}
        rows.append([f"{space}, here", *(f"{np.mean(v):.0f} ± {np.std(v):.0f}" for v in values.values())])
        contrast = {m: np.mean([r.contrast for r in responses[space, m]]) for m in Measure}
        rows.append([f"{space}, over the background's sd", *(f"{c:.1f}" for c in contrast.values())])
    title = f"Table 4.1: selectivity, mean and standard deviation over {images} images"
    return Grid.of(title, ["", *Measure], rows)


def agreement(responses: Mapping[Key, Sequence[Response]]) -> Grid:
    """Return the rankings of the measures in the thesis and here."""
    rows = []
    for space, thesis in TABLE_4_1.items():
        here = _means(responses, space)
        pairs = list(combinations(Measure, 2))
        other = [(a, b) for a, b in pairs if (thesis[a] - thesis[b]) * (here[a] - here[b]) < 0]
        reversed_pairs = ", ".join(
            f"{max(p, key=here.__getitem__)} over {min(p, key=here.__getitem__)}" for p in other
        )
        rows.append(
            [
                space,
                _order(thesis),
                _order(here),
                f"{len(pairs) - len(other)} of {len(pairs)}",
                reversed_pairs,
            ]
        )
    here = _means(responses, PropertySpace.DIRECTIVITY)
    rows.append([PropertySpace.DIRECTIVITY, "left open", _order(here), "", ""])
    columns = [
        "space",
        "order in the thesis",
        "order here",
        "pairs in the same order",
        "pairs in the opposite order",
    ]
    return Grid.of("Ranking of the measures", columns, rows)


def _order(values: Mapping[Measure, float]) -> str:
    ranked: list[Measure] = sorted(values, key=lambda m: -values[m])
    return " > ".join(ranked)


def _proximities(templates: TemplateSet) -> Iterable[Grid]:
    tables = {PropertySpace.GRAY: "Table 4.2", PropertySpace.EDGE: "Table 4.3"}
    for (side, space), tree in templates.trees.items():
        matrix = tree_proximities(tree)
        names = ["root", *(f"RT#{k}" for k in range(1, len(matrix)))]
        rows = [
            [name, *("" if j < i else f"{value:.3f}" for j, value in enumerate(row)), f"{row.mean():.3f}"]
            for i, (name, row) in enumerate(zip(names, matrix, strict=True))
        ]
        if space in ROW_MEANS:
            means = ROW_MEANS[space]
            spread = f"{means[0]:.3f}, {min(means[1:]):.3f} to {max(means[1:]):.3f}"
            title = f"{tables[space]}: {side} {space} templates (row means in the thesis: root {spread})"
        else:
            title = f"{side} {space} templates"
        yield Grid.of(title, ["", *names, "row mean"], rows)


if __name__ == "__main__":
    sys.exit(main())
