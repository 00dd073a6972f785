"""Drawings of a spine: outlines of the vertebrae of two stages in the coronal, sagittal and top view, as plain numbers.

Positions and orientations are those of the vertebrae; the sizes of the bodies are schematic, in proportion to the
distance of the neighbours. The template turns a drawing into SVG.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from contract.spine import StageSpine, VertebraState
from spinewatch.arrays import Float
from spinewatch.spine.configuration import Origin


class Side(StrEnum):
    """Side that a spine is looked at from."""

    CORONAL = "coronal"
    SAGITTAL = "sagittal"
    TOP = "top"


@dataclass(frozen=True)
class DrawingParameters:
    """Sizes of a drawing.

    Attributes
    ----------
    body_height
        Height of a body as a fraction of the distance to its neighbours.
    body_width, body_depth
        Width and depth of a body as multiples of its height.
    default_spacing_mm
        Distance of the neighbours where there are none, mm.
    margin
        Free space around the bodies, units of the drawing.
    label_width
        Room for labels at the right, units of the drawing.
    width, height
        Largest size of the bodies' part of a drawing, units of the drawing.
    cobb_line_mm
        Length of a Cobb line to each side of the body's centre, mm.
    scale_bar_mm
        Length of the scale bar of the coronal and sagittal view, mm.
    top_scale_bar_mm
        The same of the top view, mm.
    """

    body_height: float = 0.72
    body_width: float = 1.45
    body_depth: float = 1.15
    default_spacing_mm: float = 25.0
    margin: float = 26.0
    label_width: float = 34.0
    width: float = 250.0
    height: float = 430.0
    cobb_line_mm: float = 46.0
    scale_bar_mm: float = 50.0
    top_scale_bar_mm: float = 20.0


@dataclass(frozen=True)
class _Projection:
    """How a view looks at patient axes: rows give right and down of the drawing.

    Attributes
    ----------
    axes
        Drawing from patient axes, shape (2, 3).
    edges
        Names at the left, right, top and bottom edge.
    across, along
        Column of the rotation, and multiple of the height, of the two half axes of a body's outline.
    title
        Name of the view.
    """

    axes: tuple[tuple[float, float, float], tuple[float, float, float]]
    edges: tuple[str, str, str, str]
    across: int
    along: int
    title: str


_PROJECTIONS: Mapping[Side, _Projection] = MappingProxyType(
    {
        Side.CORONAL: _Projection(
            ((0, -1, 0), (0, 0, -1)), ("L", "R", "head", "feet"), 1, 2, "Coronal, from behind"
        ),
        Side.SAGITTAL: _Projection(
            ((1, 0, 0), (0, 0, -1)), ("P", "A", "head", "feet"), 0, 2, "Sagittal, from the right"
        ),
        Side.TOP: _Projection(((0, -1, 0), (-1, 0, 0)), ("L", "R", "A", "P"), 1, 0, "From above (head)"),
    }
)


@dataclass(frozen=True)
class Body:
    """A vertebral body in a drawing; units of the drawing, x to the right and y down.

    Attributes
    ----------
    level
        Name of the vertebra.
    origin
        Where its pose comes from.
    outline
        Corners of the body, in order around it.
    centre
        Its centroid.
    front
        End of a line from the centroid along the vertebra's anterior axis, in the view from above.
    outlined
        Whether its outline is drawn: in the view from above only those of the curves' end vertebrae and apices.
    """

    level: str
    origin: Origin
    outline: tuple[tuple[float, float], ...]
    centre: tuple[float, float]
    front: tuple[float, float]
    outlined: bool


@dataclass(frozen=True)
class Line:
    """A straight line in a drawing.

    Attributes
    ----------
    start, end
        Its ends.
    """

    start: tuple[float, float]
    end: tuple[float, float]


@dataclass(frozen=True)
class Layer:
    """The spine at one stage in a drawing.

    Attributes
    ----------
    stage
        Name of the stage.
    role
        ``before`` or ``after``; a drawing of one stage has ``after`` only.
    bodies
        Its vertebrae, cranial first.
    lines
        Lines between the centroids of neighbours.
    cobb
        Lines along the outer end plates of the curves' end vertebrae; coronal view only.
    """

    stage: str
    role: str
    bodies: tuple[Body, ...]
    lines: tuple[Line, ...]
    cobb: tuple[Line, ...]


@dataclass(frozen=True)
class Label:
    """A text in a drawing.

    Attributes
    ----------
    text
        The text.
    at
        Where it starts, on its base line.
    """

    text: str
    at: tuple[float, float]


@dataclass(frozen=True)
class Drawing:
    """One view of the spine at one or two stages.

    Attributes
    ----------
    side
        The side that it is looked at from.
    title
        Name of the view.
    description
        Sentence for who cannot see it.
    width, height
        Size, units of the drawing.
    layers
        Stages, the earlier one first.
    labels
        Names of vertebrae.
    edges
        Names of the left, right, top and bottom edge.
    bar, bar_mm
        Length of the scale bar, units of the drawing and mm.
    """

    side: Side
    title: str
    description: str
    width: float
    height: float
    layers: tuple[Layer, ...]
    labels: tuple[Label, ...]
    edges: tuple[str, str, str, str]
    bar: float
    bar_mm: float


def draw(
    spines: Sequence[StageSpine], side: Side, parameters: DrawingParameters | None = None
) -> Drawing | None:
    """Return a drawing of one or two stages in the same axes and at the same scale.

    Parameters
    ----------
    spines
        The spine at one stage, or at an earlier and a later one.
    side
        The side to look at it from.
    parameters
        Sizes of the drawing.

    Returns
    -------
    Drawing or None
        The drawing; None if no vertebra has a pose.
    """
    parameters = parameters or DrawingParameters()
    sheets = [_Sheet.of(spine, side, parameters) for spine in spines]
    points = np.concatenate([sheet.points for sheet in sheets])
    if len(points) == 0:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    scale = float(min(np.array([parameters.width, parameters.height]) / np.maximum(high - low, 1.0)))
    place = _Place(low, scale, parameters.margin)
    roles = ("before", "after") if len(sheets) == 2 else ("after",)
    width, height = (high - low) * scale + 2 * parameters.margin
    right = float(width) - 8.0
    stages = " and ".join(spine.stage for spine in spines)
    bar_mm = parameters.top_scale_bar_mm if side is Side.TOP else parameters.scale_bar_mm
    layers = tuple(sheet.layer(role, place) for sheet, role in zip(sheets, roles, strict=True))
    return Drawing(
        side=side,
        title=_PROJECTIONS[side].title,
        description=f"{_PROJECTIONS[side].title}: outlines of the vertebrae at {stages}",
        width=float(width) + parameters.label_width,
        height=float(height) + 16.0,
        layers=layers,
        labels=_labels(side, layers[-1], right),
        edges=_PROJECTIONS[side].edges,
        bar=bar_mm * scale,
        bar_mm=bar_mm,
    )


@dataclass(frozen=True)
class _Place:
    """Where a point of a view is in the drawing."""

    low: Float
    scale: float
    margin: float

    def __call__(self, point: Float) -> tuple[float, float]:
        x, y = (point - self.low) * self.scale + self.margin
        return float(x), float(y)


@dataclass(frozen=True, eq=False)
class _Sheet:
    """Bodies of one stage, projected, mm."""

    spine: StageSpine
    states: tuple[VertebraState, ...]
    outlines: tuple[Float, ...]
    centres: tuple[Float, ...]
    fronts: tuple[Float, ...]
    cobb: tuple[tuple[Float, Float], ...]
    outlined: frozenset[str]

    @property
    def points(self) -> Float:
        ends = [point[np.newaxis] for line in self.cobb for point in line]
        return np.concatenate(
            [np.empty((0, 2)), *self.outlines, *[f[np.newaxis] for f in self.fronts], *ends]
        )

    @classmethod
    def of(cls, spine: StageSpine, side: Side, parameters: DrawingParameters) -> _Sheet:
        view = _PROJECTIONS[side]
        axes = np.array(view.axes, float)
        states = tuple(state for state in spine.vertebrae if state.position_mm is not None)
        heights = _heights(spine.vertebrae, parameters)
        outlines, fronts, plates = [], [], {}
        for state in states:
            c, R, height = np.array(state.position_mm), np.array(state.rotation), heights[state.vertebra]
            size = height * np.array([parameters.body_depth, parameters.body_width, 1.0])
            a, b = R[:, view.across] * size[view.across] / 2, R[:, view.along] * size[view.along] / 2
            outlines.append(np.array([c + a + b, c - a + b, c - a - b, c + a - b]) @ axes.T)
            fronts.append((c + R[:, 0] * size[0]) @ axes.T)
            plates[state.vertebra] = _end_plates(c, R, height, parameters.cobb_line_mm) @ axes.T
        centres = tuple(np.array(state.position_mm) @ axes.T for state in states)
        cobb: list[tuple[Float, Float]] = []
        for curve in spine.curves if side is Side.CORONAL else ():
            cobb += [
                (*plates[level][end],)
                for level, end in ((curve.upper, 0), (curve.lower, 1))
                if level in plates
            ]
        fronts = fronts if side is Side.TOP else list(centres)
        outlined = _outlined(spine, states, side)
        return cls(spine, states, tuple(outlines), centres, tuple(fronts), tuple(cobb), outlined)

    def layer(self, role: str, place: _Place) -> Layer:
        bodies = tuple(
            Body(
                state.vertebra,
                state.origin,
                tuple(place(corner) for corner in outline),
                place(centre),
                place(front),
                state.vertebra in self.outlined,
            )
            for state, outline, centre, front in zip(
                self.states, self.outlines, self.centres, self.fronts, strict=True
            )
        )
        places = {state.vertebra: number for number, state in enumerate(self.spine.vertebrae)}
        neighbours = (
            (upper, lower)
            for upper, lower in pairwise(bodies)
            if places[lower.level] - places[upper.level] == 1
        )
        return Layer(
            self.spine.stage,
            role,
            bodies,
            tuple(Line(upper.centre, lower.centre) for upper, lower in neighbours),
            tuple(Line(place(start), place(end)) for start, end in self.cobb),
        )


def _end_plates(c: Float, R: Float, height: float, half_mm: float) -> Float:
    """Return the ends of lines along the upper and the lower end plate, shape (2, 2, 3)."""
    up, across = R[:, 2] * height / 2, R[:, 1] * half_mm
    return np.array([[c + up - across, c + up + across], [c - up - across, c - up + across]])


def _heights(states: Iterable[VertebraState], parameters: DrawingParameters) -> dict[str, float]:
    """Return heights of the bodies from the mean distance of each to its neighbours, mm."""
    found = list(states)
    points = [None if state.position_mm is None else np.array(state.position_mm) for state in found]
    gaps = [None if a is None or b is None else float(np.linalg.norm(b - a)) for a, b in pairwise(points)]
    known = [gap for gap in gaps if gap]
    usual = float(np.median(known)) if known else parameters.default_spacing_mm
    heights = {}
    for number, state in enumerate(found):
        near = [gap for gap in gaps[max(number - 1, 0) : number + 1] if gap]
        heights[state.vertebra] = parameters.body_height * (float(np.mean(near)) if near else usual)
    return heights


def _labels(side: Side, layer: Layer, right: float) -> tuple[Label, ...]:
    """Return the names: at the right edge beside each body, in the view from above at the tips of the outlined ones."""
    if side is not Side.TOP:
        return tuple(Label(body.level, (right, body.centre[1] + 3.5)) for body in layer.bodies)
    named = (body for body in layer.bodies if body.outlined)
    return tuple(Label(body.level, (body.front[0] + 3.0, body.front[1] - 2.0)) for body in named)


def _outlined(spine: StageSpine, states: Sequence[VertebraState], side: Side) -> frozenset[str]:
    """Return the vertebrae whose outline is drawn: bodies lie on each other in the view from above."""
    levels = [state.vertebra for state in states]
    if side is not Side.TOP:
        return frozenset(levels)
    named = {level for curve in spine.curves for level in curve.vertebrae}
    return frozenset(named or {*levels[:1], *levels[-1:]})
