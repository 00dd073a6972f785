"""Template sets from images in which somebody has marked the balls (thesis section 4.3.2)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Floating
from spinewatch.detection.candidates.clusters import complete_link, silhouette
from spinewatch.detection.candidates.property_spaces import Planes, PropertySpace, property_planes
from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.candidates.templates import (
    Side,
    TemplateError,
    TemplateSet,
    TemplateTree,
    build_tree,
    cut_samples,
    normalise_samples,
    round_mask,
    sample_distances,
)
from spinewatch.imaging.exposure import correct_exposure, log_tone, to_gray, truncated_median_filter

REFERENCE_PX = (9.0, 9.0 / 0.845)
"""Ball size (width, height) of a stored template: that of the 1995 cart's balls and pixels."""


@dataclass(frozen=True, eq=False)
class AnnotatedView:
    """An image (H, W) of one side, with the centres (n, 2) and sizes (n, 2: width, height) of its balls in pixels."""

    image: NDArray[np.unsignedinteger]
    side: Side
    centres_px: NDArray[np.float64]
    balls_px: NDArray[np.float64]


@dataclass(frozen=True)
class BuildParameters:
    """Parameters of ``build_template_set``.

    Classes per property space: None takes the number, from 2 to ``max_classes``, with the greatest mean silhouette;
    six gray and four edge classes are what the thesis found by eye. ``mask_radii``: the mask's radius in ball radii,
    the ball and a thin ring about it. ``white_ridge``: how much independent clutter is supposed beside the
    correlated, as a multiple of its mean variance.
    """

    gray_classes: int | None = None
    edge_classes: int | None = None
    directivity_classes: int | None = None
    max_classes: int = 8
    mask_radii: float = 1.38
    white_ridge: float = 3.0


@dataclass(frozen=True, eq=False)
class BuiltSet:
    """A template set, and by property space the mean silhouette of each number of classes that was tried."""

    templates: TemplateSet
    silhouettes: Mapping[PropertySpace, Mapping[int, float]]


def build_template_set(
    views: Iterable[AnnotatedView], version: str, parameters: BuildParameters, detection: DetectionParameters
) -> BuiltSet:
    """Return the trees of both sides in all property spaces, prepared just as ``detect`` prepares an image.

    The root of the directivity space is whitened: what balls have in common with wounds counts less than what
    tells them apart. Raises ``TemplateError`` when a side has too few balls for its classes.
    """
    views = tuple(views)
    if len({view.side for view in views}) < len(get_args(Side)):
        raise TemplateError("a template set needs balls in left and in right images; annotate both")
    samples, clutter = _collect(views, detection)
    mask = round_mask(REFERENCE_PX, parameters.mask_radii)
    fixed = {
        PropertySpace.GRAY: parameters.gray_classes,
        PropertySpace.EDGE: parameters.edge_classes,
        PropertySpace.DIRECTIVITY: parameters.directivity_classes,
    }
    trees: dict[tuple[Side, PropertySpace], TemplateTree] = {}
    silhouettes: dict[PropertySpace, dict[int, float]] = {}
    for space, count in fixed.items():
        sides = {side: samples[side, space] for side in get_args(Side)}
        if count is None:
            units = [normalise_samples(space, patches, mask) for patches in sides.values()]
            silhouettes[space] = class_silhouettes(units, parameters.max_classes)
            count = max(silhouettes[space], key=silhouettes[space].__getitem__)  # noqa: PLW2901
        for side, patches in sides.items():
            trees[side, space] = build_tree(space, patches, mask, count)
    noise = clutter_covariance(clutter, mask)
    for side in get_args(Side):
        tree = trees[side, PropertySpace.DIRECTIVITY]
        white = whiten(tree.roots, mask, noise, parameters.white_ridge)
        trees[side, PropertySpace.DIRECTIVITY] = replace(tree, roots=white)
    return BuiltSet(TemplateSet(version, REFERENCE_PX, trees), silhouettes)


def class_silhouettes(units: Sequence[Floating], most: int) -> dict[int, float]:
    """Return the mean silhouette over all sides' normalised samples of 2 to ``most`` complete-link classes, in order.

    The sides share the criterion, so that they get as many classes and twice the samples decide. Raises
    ``TemplateError`` when a side has fewer than three samples.
    """
    distances = [sample_distances(unit) for unit in units]
    counts = range(2, min(most, *(len(distance) - 1 for distance in distances)) + 1)
    if not counts:
        raise TemplateError("classes need three balls a side to be told apart; annotate more")
    return {
        count: float(
            np.mean([silhouette(distance, complete_link(distance, count)) for distance in distances])
        )
        for count in counts
    }


def _collect(
    views: Sequence[AnnotatedView], detection: DetectionParameters
) -> tuple[dict[tuple[Side, PropertySpace], Floating], list[Planes]]:
    """Return each side's samples (m, C, 19, 19) by property space, and the gradients of all images."""
    gradients: list[Planes] = []
    samples: dict[tuple[Side, PropertySpace], list[Floating]] = defaultdict(list)
    for view in views:
        gray, _ = correct_exposure(to_gray(view.image), detection.preprocess)
        published = truncated_median_filter(gray)
        logged = log_tone(gray, detection.log_offset, 0.0)
        gradients.append(property_planes(logged, PropertySpace.DIRECTIVITY))
        for space in PropertySpace:
            planes = property_planes(logged if space is PropertySpace.DIRECTIVITY else published, space)
            for centre, (width, height) in zip(view.centres_px, view.balls_px, strict=True):
                scale = (REFERENCE_PX[0] / width, REFERENCE_PX[1] / height)
                samples[view.side, space].append(cut_samples(planes, [tuple(centre)], scale))
    return {key: np.concatenate(patches) for key, patches in samples.items()}, gradients


def clutter_covariance(gradients: Sequence[Planes], mask: Floating) -> Floating:
    """Return the covariance (2p, 2p) of gradient vectors within a mask (h, w) of p pixels, laid anywhere on images.

    Gradients (2, H, W) are divided by their local strength, since similarity ignores it; the covariance of two
    places is the autocorrelation at their distance.
    """
    reach = max(mask.shape) - 1
    table = np.mean([_autocorrelation(_even_strength(g), reach) for g in gradients], axis=0)
    y, x = np.nonzero(mask)
    lags = table[:, :, y[:, None] - y + reach, x[:, None] - x + reach]
    size = 2 * len(y)
    return np.asarray(lags.transpose(0, 2, 1, 3).reshape(size, size))


def whiten(roots: Floating, mask: Floating, clutter: Floating, ridge: float) -> Floating:
    """Return roots (n, C, h, w) as matched filters against clutter (C p, C p): ``(clutter + ridge I)^-1 root``."""
    inside = mask > 0
    flat = roots[:, :, inside].reshape(len(roots), -1).astype(np.float64)
    noise = ridge * np.trace(clutter) / len(clutter)
    filters = np.linalg.solve((clutter + clutter.T) / 2 + noise * np.eye(len(clutter)), flat.T).T
    white = np.zeros_like(roots)
    white[:, :, inside] = (filters / np.linalg.norm(filters, axis=1, keepdims=True)).reshape(
        *roots.shape[:2], -1
    )
    return white


def _even_strength(gradient: Planes) -> NDArray[np.float64]:
    size = 15  # somewhat more than a template
    power = cv2.boxFilter((gradient.astype(np.float64) ** 2).sum(axis=0), -1, (size, size))
    strength = np.sqrt(np.maximum(power, 0))
    return np.asarray(gradient / (strength + 0.3 * np.median(strength)))


def _autocorrelation(planes: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """Return (C, C, 2 reach + 1, 2 reach + 1): mean products of planes (C, H, W) with themselves, by lag."""
    h, w = planes.shape[1:]
    size = (h + reach, w + reach)
    spectrum = np.fft.rfft2(planes, s=size)
    product = spectrum[:, None] * spectrum.conj()[None]
    lags = np.roll(np.fft.irfft2(product, s=size), (reach, reach), axis=(2, 3)) / (h * w)
    return np.asarray(lags[:, :, : 2 * reach + 1, : 2 * reach + 1])
