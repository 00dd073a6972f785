"""Template sets from images in which the balls are annotated (thesis section 4.3.2)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Float, Floating, Single
from spinewatch.detection.candidates.clusters import complete_link, silhouette
from spinewatch.detection.candidates.property_spaces import PropertySpace, property_planes
from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.candidates.template_samples import (
    build_tree,
    cut_samples,
    normalize_samples,
    round_mask,
    sample_distances,
)
from spinewatch.detection.candidates.templates import TemplateError, TemplateSet, TemplateTree
from spinewatch.detection.candidates.whitening import WhiteningParameters, clutter_covariance, whiten
from spinewatch.imaging.exposure import correct_exposure
from spinewatch.imaging.filters import truncated_median_filter
from spinewatch.imaging.frame import SIDES, Frame, Side
from spinewatch.imaging.tone import log_tone

REFERENCE_PX = (9.0, 9.0 / 0.845)
"""Width and height of the balls of stored templates, px: those of the 1995 cart's balls and pixels."""


@dataclass(frozen=True, eq=False)
class AnnotatedView:
    """A frame and the balls that it shows.

    Attributes
    ----------
    frame
        The image.
    centres_px
        Centres (u, v) of the balls, shape (n, 2), px.
    balls_px
        Widths and heights of the balls, shape (n, 2), px.
    """

    frame: Frame
    centres_px: Float
    balls_px: Float


@dataclass(frozen=True)
class BuildParameters:
    """Parameters of `build_template_set`.

    Attributes
    ----------
    gray_classes, edge_classes, directivity_classes
        Number of classes of each property space; None selects the number with the greatest mean silhouette. The thesis
        found six gray and four edge classes by eye.
    max_classes
        Greatest number of classes tried; the least is 2.
    mask_radii
        Radius of the mask in ball radii: the ball and a thin ring about it.
    whitening
        Model of the clutter.
    """

    gray_classes: int | None = None
    edge_classes: int | None = None
    directivity_classes: int | None = None
    max_classes: int = 8
    mask_radii: float = 1.38
    whitening: WhiteningParameters = field(default_factory=WhiteningParameters)


@dataclass(frozen=True, eq=False)
class BuiltSet:
    """A new template set and the criterion by which its classes were selected.

    Attributes
    ----------
    templates
        The set.
    silhouettes
        Mean silhouette of each number of classes that was tried, by property space.
    """

    templates: TemplateSet
    silhouettes: Mapping[PropertySpace, Mapping[int, float]]


def build_template_set(
    views: Iterable[AnnotatedView], version: str, parameters: BuildParameters, detection: DetectionParameters
) -> BuiltSet:
    """Return the template set of annotated images, which are prepared as `detect` prepares an image.

    The root of the directivity space is whitened, so that what balls have in common with wounds has less weight than
    what distinguishes them.

    Parameters
    ----------
    views
        Images of both sides.
    version
        Name of the set.
    parameters
        Numbers of classes, mask and whitening.
    detection
        Preparation of images.

    Returns
    -------
    BuiltSet
        The set and the silhouettes of the numbers of classes.

    Raises
    ------
    TemplateError
        When a side has no images or too few balls for its classes.
    """
    views = tuple(views)
    if len({view.frame.side for view in views}) < len(SIDES):
        raise TemplateError("a template set needs balls in left and in right images; annotate both")
    samples, gradients = _collect(views, detection)
    mask = round_mask(REFERENCE_PX, parameters.mask_radii)
    n_classes = {
        PropertySpace.GRAY: parameters.gray_classes,
        PropertySpace.EDGE: parameters.edge_classes,
        PropertySpace.DIRECTIVITY: parameters.directivity_classes,
    }
    trees: dict[tuple[Side, PropertySpace], TemplateTree] = {}
    silhouettes: dict[PropertySpace, dict[int, float]] = {}
    for space, fixed in n_classes.items():
        sides = {side: samples[side, space] for side in SIDES}
        count = fixed
        if count is None:
            units = [normalize_samples(space, patches, mask) for patches in sides.values()]
            silhouettes[space] = class_silhouettes(units, parameters.max_classes)
            count = max(silhouettes[space], key=silhouettes[space].__getitem__)
        for side, patches in sides.items():
            trees[side, space] = build_tree(space, patches, mask, count)
    clutter = clutter_covariance(gradients, mask, parameters.whitening)
    for side in SIDES:
        tree = trees[side, PropertySpace.DIRECTIVITY]
        white = whiten(tree.roots, mask, clutter, parameters.whitening.ridge)
        trees[side, PropertySpace.DIRECTIVITY] = replace(tree, roots=white)
    return BuiltSet(TemplateSet(version, REFERENCE_PX, trees), silhouettes)


def class_silhouettes(units: Sequence[Floating], max_classes: int) -> dict[int, float]:
    """Return the quality of each number of complete-link classes.

    The sides share the criterion, so that they have the same number of classes and twice the samples decide on it.

    Parameters
    ----------
    units
        Normalized samples of each side, shape (m, C, h, w).
    max_classes
        Greatest number of classes tried.

    Returns
    -------
    dict of int to float
        Mean silhouette over the sides of 2 to ``max_classes`` classes, in order.

    Raises
    ------
    TemplateError
        When a side has fewer than three samples.

    Examples
    --------
    >>> unit = np.array([[1.0, 0.0], [1.0, 0.1], [0.0, 1.0], [0.1, 1.0]]).reshape(4, 1, 1, 2)
    >>> values = class_silhouettes([unit], max_classes=8)
    >>> max(values, key=values.get)
    2
    """
    distances = [sample_distances(unit) for unit in units]
    counts = range(2, min(max_classes, *(len(distance) - 1 for distance in distances)) + 1)
    if not counts:
        raise TemplateError("classes need at least three balls per side; annotate more")
    return {
        count: float(
            np.mean([silhouette(distance, complete_link(distance, count)) for distance in distances])
        )
        for count in counts
    }


def _collect(
    views: Sequence[AnnotatedView], detection: DetectionParameters
) -> tuple[dict[tuple[Side, PropertySpace], Floating], list[Single]]:
    """Return each side's samples (m, C, 19, 19) by property space, and the gradients of all images."""
    gradients: list[Single] = []
    samples: dict[tuple[Side, PropertySpace], list[Floating]] = defaultdict(list)
    for view in views:
        gray, _ = correct_exposure(view.frame.gray(), detection.exposure)
        published = truncated_median_filter(gray)
        logged = log_tone(gray, detection.log_offset, 0.0)
        gradients.append(property_planes(logged, PropertySpace.DIRECTIVITY))
        for space in PropertySpace:
            planes = property_planes(logged if space is PropertySpace.DIRECTIVITY else published, space)
            for centre, (width, height) in zip(view.centres_px, view.balls_px, strict=True):
                scale = (REFERENCE_PX[0] / width, REFERENCE_PX[1] / height)
                samples[view.frame.side, space].append(cut_samples(planes, [tuple(centre)], scale))
    return {key: np.concatenate(patches) for key, patches in samples.items()}, gradients
