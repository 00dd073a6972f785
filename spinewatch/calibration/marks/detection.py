"""Targets: dark marks (discs or crosses) on white peg tops, found and centred to a few hundredths of a pixel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Pixels

_MARGIN = 3
_SMOOTHING_PX = 0.6
_FINER = 8
_EDGE_WIDTH_PX = 2.0
_FLOOR_PX = 0.015
_RING = 1.35  # outer over inner size of the white around a mark that has no top
_WHITE = 0.97

_Image = NDArray[np.integer | np.floating]
_Outline = NDArray[np.integer | np.floating]


@dataclass(frozen=True)
class TargetParameters:
    """What counts as a target.

    ``levels`` gray levels at which the image is cut; ``min_width_px`` of a mark; ``max_fraction`` of the image
    that a mark may cover; ``area_ratio`` (least, most) of peg top to mark; ``min_contrast`` of mark against
    top, as a fraction of the top's brightness; ``max_eccentricity`` of centres of top and mark, in mark
    diameters; ``min_repeats`` levels at which the mark must show. When fewer than ``enough`` marks have a top that
    stands out from the board, marks that are merely surrounded by white count too.
    """

    levels: int = 16
    min_width_px: float = 4.0
    max_fraction: float = 0.01
    area_ratio: tuple[float, float] = (1.5, 14.0)
    min_contrast: float = 0.3
    max_eccentricity: float = 0.25
    max_axis_ratio: float = 3.0
    min_repeats: int = 2
    enough: int = 8


@dataclass(frozen=True, eq=False)
class Targets:
    """Targets of an image: ``pixels`` (n, 2) centres of the marks.

    ``sd_px`` (n,) per coordinate; ``contrast`` (n,) in gray levels; ``spread_px2`` (n,) the geometric mean of a
    mark's two principal variances, a quarter of the squared radius for a disc.
    """

    pixels: Float
    sd_px: Float
    contrast: Float
    spread_px2: Float

    def __len__(self) -> int:
        return len(self.pixels)


@dataclass(frozen=True, eq=False)
class _Mark:
    centre: Float
    mark: _Outline
    top: _Outline
    area: float


_Judge = Callable[[_Outline, _Outline, _Image, TargetParameters], _Mark | None]
"""Tells whether a hole, in a region, of a picture cut at a level, is a mark."""


def find_targets(image: Pixels, parameters: TargetParameters | None = None) -> Targets:
    """Return the targets of a gray image (H, W), brightest contrast first.

    The image is cut at several gray levels. A mark is a hole in a bright region whose outline is smooth,
    elliptic, not much larger than the mark, and shares its centre; this takes discs and crosses alike, and
    leaves out marks that the image's border or another peg cuts. On a board as white as the peg tops, marks are
    what is round, or a cross, and has white around it.
    """
    parameters = parameters or TargetParameters()
    gray = image.astype(np.float32)
    smooth = cv2.GaussianBlur(gray, (0, 0), _SMOOTHING_PX)  # grain makes thousands of regions
    rows = _find(gray, smooth, _on_top, parameters)
    if len(rows) < parameters.enough:
        rows = _find(gray, smooth, _on_white, parameters)
    rows.sort(key=lambda row: -row[3])
    table = np.array(rows).reshape(-1, 5)
    return Targets(table[:, :2], table[:, 2], table[:, 3], table[:, 4])


def _find(
    gray: _Image, smooth: _Image, judge: _Judge, parameters: TargetParameters
) -> list[tuple[float, ...]]:
    found: list[list[_Mark]] = []
    for level in _levels(smooth, parameters.levels):
        for mark in _marks_at(smooth, level, judge, parameters):
            for group in found:
                if np.hypot(*(group[0].centre - mark.centre)) < 0.5 * np.sqrt(group[0].area):
                    group.append(mark)
                    break
            else:
                found.append([mark])
    rows = []
    for group in found:
        if len(group) >= parameters.min_repeats:
            middle = sorted(group, key=lambda m: m.area)[len(group) // 2]
            centred = _centre(gray, middle, parameters)
            if centred is not None:
                rows.append(centred)
    return rows


def _levels(gray: _Image, count: int) -> Float:
    """Return gray levels, denser towards the brightest, where peg tops stand out from a light board."""
    low, high = np.percentile(gray, [2, 99.8])
    return np.asarray(low + (high - low) * np.linspace(0, 1, count + 2)[1:-1] ** 0.6)


def _marks_at(gray: _Image, level: float, judge: _Judge, parameters: TargetParameters) -> list[_Mark]:
    bright = (gray > level).astype(np.uint8)
    contours, hierarchy = cv2.findContours(bright, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return []
    out = []
    smallest = 0.5 * parameters.min_width_px**2
    largest = parameters.max_fraction * gray.size
    longest = 4 * np.sqrt(largest)
    for i, (_, _, _, parent) in enumerate(hierarchy[0]):
        if parent < 0 or not 8 <= len(contours[i]) <= longest:
            continue
        if smallest <= cv2.contourArea(contours[i]) <= largest:
            mark = judge(contours[i], contours[parent], bright, parameters)
            if mark is not None:
                out.append(mark)
    return out


def _on_top(hole: _Outline, top: _Outline, bright: _Image, parameters: TargetParameters) -> _Mark | None:
    """Return a hole in a bright ellipse that shares its centre and is not much larger."""
    low, high = parameters.area_ratio
    if len(top) > 4 * np.sqrt(parameters.max_fraction * bright.size * high):
        return None
    area, top_area = cv2.contourArea(hole), cv2.contourArea(top)
    if not low * area <= top_area <= high * area * 1.5:
        return None
    hull_area = cv2.contourArea(cv2.convexHull(hole))
    if not low * hull_area <= top_area <= high * hull_area:
        return None
    ellipse = cv2.fitEllipse(top) if len(top) >= 5 else None
    if ellipse is None or not _is_ellipse(top, top_area, ellipse[1], parameters):
        return None
    centre, mark_centre = np.array(ellipse[0]), _moments_centre(hole)
    if np.hypot(*(centre - mark_centre)) > parameters.max_eccentricity * np.sqrt(hull_area):
        return None
    return _Mark(mark_centre, hole, top, hull_area)


def _on_white(hole: _Outline, _: _Outline, bright: _Image, parameters: TargetParameters) -> _Mark | None:
    """Return an elliptic hole, or a cross, with nothing dark around it."""
    hull = cv2.convexHull(hole)
    area = cv2.contourArea(hull)
    if len(hull) < 5 or not _is_ellipse(hull, area, cv2.fitEllipse(hull)[1], parameters):
        return None
    centre = _moments_centre(hole)
    ring = np.round(centre + _RING * (hull - centre)).astype(np.int32)
    u, v, w, h = cv2.boundingRect(ring)
    if min(u, v) < 0 or u + w > bright.shape[1] or v + h > bright.shape[0]:
        return None
    inside = np.zeros((h, w), dtype=np.uint8)
    cv2.drawContours(inside, [ring - np.array([u, v], dtype=np.int32)], -1, 1, cv2.FILLED)
    cv2.drawContours(inside, [hull - np.array([u, v], dtype=np.int32)], -1, 0, cv2.FILLED)
    around = bright[v : v + h, u : u + w][inside > 0]
    return _Mark(centre, hole, ring, area) if len(around) and np.mean(around) > _WHITE else None


def _is_ellipse(outline: _Outline, area: float, axes: Sequence[float], parameters: TargetParameters) -> bool:
    a, b = axes
    if min(a, b) <= 0 or max(a, b) > parameters.max_axis_ratio * min(a, b):
        return False
    hull = cv2.contourArea(cv2.convexHull(outline))
    return bool(area > 0.85 * hull and 0.8 < area / (np.pi / 4 * a * b) < 1.2)


def _moments_centre(contour: _Outline) -> Float:
    m = cv2.moments(contour)
    return np.array([m["m10"], m["m01"]]) / m["m00"]


def _centre(gray: _Image, mark: _Mark, parameters: TargetParameters) -> tuple[float, ...] | None:
    """Return u, v, sd, contrast and spread of a mark, or None when it is no clear mark.

    The centre is the centroid of what is darker than halfway to the white around it.

    The outline halfway between black and white is where the edge is, whatever the lens's blur; it is followed
    on a finer grid of cubic interpolation. The centroid of an ellipse or of a cross is the image of its centre
    to first order in the tilt.
    """
    u0, v0, w, h = cv2.boundingRect(mark.mark)
    top = np.zeros((h + 2 * _MARGIN, w + 2 * _MARGIN), dtype=np.uint8)
    corner = np.array([u0 - _MARGIN, v0 - _MARGIN])
    if corner.min() < 0 or np.any(corner + top.shape[::-1] > gray.shape[::-1]):
        return None
    patch = gray[corner[1] : corner[1] + top.shape[0], corner[0] : corner[0] + top.shape[1]]
    cv2.drawContours(top, [mark.top - corner[None, None].astype(np.int32)], -1, 1, cv2.FILLED)
    hull = np.zeros_like(top)
    cv2.drawContours(
        hull, [cv2.convexHull(mark.mark) - corner[None, None].astype(np.int32)], -1, 1, cv2.FILLED
    )
    ring = patch[(top > 0) & (hull == 0)]
    if len(ring) < 8:
        return None
    white = float(np.percentile(ring, 70))
    dark = float(np.percentile(patch[hull > 0], 10))
    contrast = white - dark
    if contrast < parameters.min_contrast * white:
        return None
    fine = cv2.resize(patch, None, fx=_FINER, fy=_FINER, interpolation=cv2.INTER_CUBIC)
    below = ((fine < (white + dark) / 2) & (cv2.resize(hull, None, fx=_FINER, fy=_FINER) > 0)).astype(
        np.uint8
    )
    _, labels, stats, centroids = cv2.connectedComponentsWithStats(below)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])) if len(stats) > 1 else 0
    if largest == 0:
        return None
    centre = (centroids[largest] + 0.5) / _FINER - 0.5 + corner
    m = cv2.moments((labels == largest).astype(np.uint8), binaryImage=True)
    variance = (m["mu20"] * m["mu02"] - m["mu11"] ** 2) / m["m00"] ** 2 / _FINER**4
    area = m["m00"] / _FINER**2
    noise = float(1.4826 * np.median(np.abs(np.diff(patch[hull > 0])))) / np.sqrt(2)
    edge_px = np.sqrt(4 * np.pi * area)
    sd = float(np.hypot(_EDGE_WIDTH_PX * noise / contrast / np.sqrt(edge_px / 2), _FLOOR_PX))
    return float(centre[0]), float(centre[1]), sd, contrast, float(np.sqrt(max(variance, 0.0)))
