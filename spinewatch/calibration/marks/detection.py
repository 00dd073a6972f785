"""Targets: dark marks (discs or crosses) on white peg tops, detected and centred to a few hundredths of a pixel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Pixels, Single
from spinewatch.robust import MAD_TO_SD

_MARGIN_PX = 3
_MIN_OUTLINE_POINTS = 8
_MIN_ELLIPSE_POINTS = 5

_Binary = NDArray[np.uint8]
_Outline = NDArray[np.integer | np.floating]


@dataclass(frozen=True)
class TargetParameters:
    """What counts as a target, and how it is centred.

    Attributes
    ----------
    smoothing_px
        Standard deviation of the filter against grain before the image is binarized, px.
    levels
        Number of gray levels at which the image is binarized, ...
    level_percentiles
        ... between these percentiles of the image, ...
    level_exponent
        ... denser towards the brightest for exponents below 1: there peg tops stand out from a light board.
    min_levels
        Levels at which a mark must be found.
    min_width_px
        Width of the smallest mark, px.
    max_area_fraction
        Area of the largest mark, as a fraction of the image.
    area_ratio
        Least and greatest area of a peg top over that of its mark.
    outline_area_slack
        Factor by which the area ratio may exceed its limit when the mark is not convex.
    max_centre_distance
        Greatest distance of the centres of peg top and mark, in square roots of the mark's area.
    max_axis_ratio
        Greatest ratio of the axes of an ellipse.
    min_solidity
        Least area of an ellipse over that of its convex hull.
    ellipse_fill
        Least and greatest area of an outline over that of its fitted ellipse.
    min_targets_on_tops
        When fewer marks lie on a distinct peg top, marks surrounded by white count too.
    surround_scale
        Outer over inner size of the white around such a mark.
    min_white_fraction
        Least fraction of it that is white.
    white_percentile, dark_percentile
        Percentiles of the peg top and of the mark that are its gray levels.
    min_contrast
        Least contrast of mark and top, as a fraction of the top's gray level.
    supersampling
        Factor by which the image is interpolated for the centre.
    edge_width_px
        Width of the blurred edge, px, for the standard deviation.
    min_sd_px
        Standard deviation of a centre without noise, px.
    """

    smoothing_px: float = 0.6
    levels: int = 16
    level_percentiles: tuple[float, float] = (2.0, 99.8)
    level_exponent: float = 0.6
    min_levels: int = 2
    min_width_px: float = 4.0
    max_area_fraction: float = 0.01
    area_ratio: tuple[float, float] = (1.5, 14.0)
    outline_area_slack: float = 1.5
    max_centre_distance: float = 0.25
    max_axis_ratio: float = 3.0
    min_solidity: float = 0.85
    ellipse_fill: tuple[float, float] = (0.8, 1.2)
    min_targets_on_tops: int = 8
    surround_scale: float = 1.35
    min_white_fraction: float = 0.97
    white_percentile: float = 70.0
    dark_percentile: float = 10.0
    min_contrast: float = 0.3
    supersampling: int = 8
    edge_width_px: float = 2.0
    min_sd_px: float = 0.015


@dataclass(frozen=True, eq=False)
class Targets:
    """Targets of an image, in decreasing order of contrast.

    Attributes
    ----------
    pixels
        Centres of the n marks, shape (n, 2), px.
    sd_px
        Standard deviations per coordinate, shape (n,), px.
    contrast
        White less dark gray level, shape (n,).
    variance_px2
        Geometric mean of the two principal variances of each mark's area, shape (n,), px^2: a quarter of the squared
        radius of a disc.
    """

    pixels: Float
    sd_px: Float
    contrast: Float
    variance_px2: Float

    def __len__(self) -> int:
        return len(self.pixels)


@dataclass(frozen=True, eq=False)
class _Mark:
    """A mark at one gray level: centre (2,), outlines of the mark and of the white around it, area of its hull."""

    centre: Float
    outline: _Outline
    surround: _Outline
    area: float


@dataclass(frozen=True, eq=False)
class _Target:
    """A centred mark."""

    centre: Float
    sd_px: float
    contrast: float
    variance_px2: float


_Classifier = Callable[[_Outline, _Outline, _Binary, TargetParameters], _Mark | None]
"""Classifies a hole, in a region, of a binary image: a mark or None."""


def find_targets(image: Pixels, parameters: TargetParameters | None = None) -> Targets:
    """Return the targets of an image.

    The image is binarized at several gray levels. A mark is a hole in a bright region whose outline is an ellipse, not
    much larger than the mark and with the same centre. This includes discs and crosses, and excludes marks that are cut
    by the border or occluded by another peg. On a board as white as the peg tops, marks are ellipses and crosses that
    are surrounded by white.

    Parameters
    ----------
    image
        Gray image, shape (H, W).
    parameters
        What counts as a target.

    Returns
    -------
    Targets
        The targets.

    References
    ----------
    Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), section 5.4.2: centroid and ellipse operators.

    Examples
    --------
    >>> import numpy as np
    >>> v, u = np.indices((160, 160))
    >>> r = np.hypot(u - 80.25, v - 79.5)
    >>> image = np.select([r < 6, r < 12], [30, 240], 110).astype(np.uint8)
    >>> bool(np.abs(find_targets(image).pixels - [80.25, 79.5]).max() < 0.2)
    True
    """
    parameters = parameters or TargetParameters()
    gray = image.astype(np.float32)
    smooth = np.asarray(cv2.GaussianBlur(gray, (0, 0), parameters.smoothing_px), dtype=np.float32)
    targets = _find(gray, smooth, _mark_on_top, parameters)
    if len(targets) < parameters.min_targets_on_tops:
        targets = _find(gray, smooth, _mark_on_white, parameters)
    targets.sort(key=lambda target: -target.contrast)
    return Targets(
        np.array([t.centre for t in targets]).reshape(-1, 2),
        np.array([t.sd_px for t in targets]),
        np.array([t.contrast for t in targets]),
        np.array([t.variance_px2 for t in targets]),
    )


def _find(gray: Single, smooth: Single, classify: _Classifier, parameters: TargetParameters) -> list[_Target]:
    """Return the targets that are found at several levels, each centred at its median size."""
    groups: list[list[_Mark]] = []
    for level in _levels(smooth, parameters):
        for mark in _marks_at(smooth, level, classify, parameters):
            group = next((g for g in groups if _is_same(g[0], mark)), None)
            if group is None:
                groups.append([mark])
            else:
                group.append(mark)
    targets = []
    for group in groups:
        if len(group) >= parameters.min_levels:
            median = sorted(group, key=lambda m: m.area)[len(group) // 2]
            if (target := _centred(gray, median, parameters)) is not None:
                targets.append(target)
    return targets


def _is_same(a: _Mark, b: _Mark) -> bool:
    return bool(np.hypot(*(a.centre - b.centre)) < 0.5 * np.sqrt(a.area))


def _levels(gray: Single, parameters: TargetParameters) -> Float:
    low, high = np.percentile(gray, parameters.level_percentiles)
    fractions = np.linspace(0, 1, parameters.levels + 2)[1:-1] ** parameters.level_exponent
    return np.asarray(low + (high - low) * fractions)


def _marks_at(gray: Single, level: float, classify: _Classifier, parameters: TargetParameters) -> list[_Mark]:
    bright = (gray > level).astype(np.uint8)
    contours, hierarchy = cv2.findContours(bright, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return []
    smallest = 0.5 * parameters.min_width_px**2
    largest = parameters.max_area_fraction * gray.size
    longest = 4 * np.sqrt(largest)
    marks = []
    for i, (_, _, _, parent) in enumerate(hierarchy[0]):
        if parent < 0 or not _MIN_OUTLINE_POINTS <= len(contours[i]) <= longest:
            continue
        if smallest <= cv2.contourArea(contours[i]) <= largest:
            mark = classify(contours[i], contours[parent], bright, parameters)
            if mark is not None:
                marks.append(mark)
    return marks


def _mark_on_top(
    hole: _Outline, top: _Outline, bright: _Binary, parameters: TargetParameters
) -> _Mark | None:
    """Return a hole in a bright ellipse that has the same centre and is not much larger."""
    low, high = parameters.area_ratio
    if len(top) > 4 * np.sqrt(parameters.max_area_fraction * bright.size * high):
        return None
    area, top_area = cv2.contourArea(hole), cv2.contourArea(top)
    if not low * area <= top_area <= high * area * parameters.outline_area_slack:
        return None
    hull_area = cv2.contourArea(cv2.convexHull(hole))
    if not low * hull_area <= top_area <= high * hull_area:
        return None
    ellipse = cv2.fitEllipse(top) if len(top) >= _MIN_ELLIPSE_POINTS else None
    if ellipse is None or not _is_ellipse(top, top_area, ellipse[1], parameters):
        return None
    centre = _centroid(hole)
    if np.hypot(*(np.array(ellipse[0]) - centre)) > parameters.max_centre_distance * np.sqrt(hull_area):
        return None
    return _Mark(centre, hole, top, hull_area)


def _mark_on_white(
    hole: _Outline, _: _Outline, bright: _Binary, parameters: TargetParameters
) -> _Mark | None:
    """Return an elliptic hole, or a cross, that is surrounded by white."""
    hull = cv2.convexHull(hole)
    area = cv2.contourArea(hull)
    if len(hull) < _MIN_ELLIPSE_POINTS or not _is_ellipse(hull, area, cv2.fitEllipse(hull)[1], parameters):
        return None
    centre = _centroid(hole)
    outer = np.round(centre + parameters.surround_scale * (hull - centre)).astype(np.int32)
    u, v, w, h = cv2.boundingRect(outer)
    if min(u, v) < 0 or u + w > bright.shape[1] or v + h > bright.shape[0]:
        return None
    ring = _filled(outer, (h, w), (u, v)) & ~_filled(hull, (h, w), (u, v))
    white = bright[v : v + h, u : u + w][ring]
    if not len(white) or np.mean(white) <= parameters.min_white_fraction:
        return None
    return _Mark(centre, hole, outer, area)


def _is_ellipse(outline: _Outline, area: float, axes: Sequence[float], parameters: TargetParameters) -> bool:
    a, b = axes
    if min(a, b) <= 0 or max(a, b) > parameters.max_axis_ratio * min(a, b):
        return False
    hull_area = cv2.contourArea(cv2.convexHull(outline))
    low, high = parameters.ellipse_fill
    return bool(area > parameters.min_solidity * hull_area and low < area / (np.pi / 4 * a * b) < high)


def _centroid(outline: _Outline) -> Float:
    m = cv2.moments(outline)
    return np.array([m["m10"], m["m01"]]) / m["m00"]


def _filled(outline: _Outline, shape: tuple[int, int], corner: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the mask of an outline's interior in a window of an image."""
    mask = np.zeros(shape, dtype=np.uint8)
    cv2.drawContours(mask, [outline - np.array(corner, dtype=np.int32)], -1, 1, cv2.FILLED)
    return mask > 0


def _centred(gray: Single, mark: _Mark, parameters: TargetParameters) -> _Target | None:
    """Return the target at the centroid of what is darker than halfway to the white, or None when it is not distinct.

    The outline halfway between dark and white is at the edge whatever the blur. The centroid of an ellipse or of a
    cross is the image of its centre to first order in the tilt.
    """
    u, v, w, h = cv2.boundingRect(mark.outline)
    corner, shape = (u - _MARGIN_PX, v - _MARGIN_PX), (h + 2 * _MARGIN_PX, w + 2 * _MARGIN_PX)
    if min(corner) < 0 or corner[0] + shape[1] > gray.shape[1] or corner[1] + shape[0] > gray.shape[0]:
        return None
    patch = gray[corner[1] : corner[1] + shape[0], corner[0] : corner[0] + shape[1]]
    inside = _filled(cv2.convexHull(mark.outline), shape, corner)
    around = patch[_filled(mark.surround, shape, corner) & ~inside]
    if len(around) < _MIN_OUTLINE_POINTS:
        return None
    white = float(np.percentile(around, parameters.white_percentile))
    dark = float(np.percentile(patch[inside], parameters.dark_percentile))
    if white - dark < parameters.min_contrast * white:
        return None
    component = _largest_dark_component(patch, inside, (white + dark) / 2, parameters.supersampling)
    if component is None:
        return None
    centre, m = component
    area = m["m00"] / parameters.supersampling**2
    determinant = (m["mu20"] * m["mu02"] - m["mu11"] ** 2) / m["m00"] ** 2 / parameters.supersampling**4
    noise = float(MAD_TO_SD * np.median(np.abs(np.diff(patch[inside])))) / np.sqrt(2)
    sd = _centre_sd_px(noise / (white - dark), area, parameters)
    return _Target(centre + corner, sd, white - dark, float(np.sqrt(max(determinant, 0.0))))


def _largest_dark_component(
    patch: Single, inside: NDArray[np.bool_], threshold: float, supersampling: int
) -> tuple[Float, dict[str, float]] | None:
    """Return centroid (2,) in patch pixels and moments in fine pixels of the largest component below a threshold."""
    fine = cv2.resize(patch, None, fx=supersampling, fy=supersampling, interpolation=cv2.INTER_CUBIC)
    fine_inside = cv2.resize(inside.astype(np.uint8), None, fx=supersampling, fy=supersampling) > 0
    dark = ((fine < threshold) & fine_inside).astype(np.uint8)
    _, labels, stats, centroids = cv2.connectedComponentsWithStats(dark)
    if len(stats) < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    moments = cv2.moments((labels == largest).astype(np.uint8), binaryImage=True)
    return (centroids[largest] + 0.5) / supersampling - 0.5, dict(moments)


def _centre_sd_px(relative_noise: float, area_px2: float, parameters: TargetParameters) -> float:
    """Return the standard deviation of a centre from noise over contrast, along the circumference of a disc."""
    circumference = np.sqrt(4 * np.pi * area_px2)
    from_noise = parameters.edge_width_px * relative_noise / np.sqrt(circumference / 2)
    return float(np.hypot(from_noise, parameters.min_sd_px))
