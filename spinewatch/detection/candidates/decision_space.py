"""From decision spaces to features (thesis section 4.3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from spinewatch.arrays import Floating
from spinewatch.detection.candidates.similarity import Measure, Templates, compare_shadows, similarity
from spinewatch.detection.candidates.templates import TemplateTree

_BLOCK = 4096
"""Shadows compared at once: few enough to stay in the cache, whatever the image shows."""


def decision_space(planes: Floating, tree: TemplateTree, measure: Measure, gate: float | None) -> Floating:
    """Return the decision space (H, W), in [0, 1], of a property space's planes (C, H, W) (eq. 4.18).

    Where the root's similarity is below ``gate`` (same scale) the value is zero, elsewhere the greatest
    similarity with a representative. ``gate`` None is the relaxed mode of section 7.2: the root's similarity
    as it stands.
    """
    roots = similarity(planes, Templates(tree.roots, tree.mask), measure)
    root = _unit_scale(_best(roots, measure, axis=0), measure)
    if gate is None:
        return root
    open_v, open_u = np.nonzero(root >= gate)
    decision = np.zeros_like(root)
    if open_v.size == 0:
        return decision
    leaves = Templates(tree.representatives, tree.mask)
    a, b = leaves.half
    padded = np.pad(
        planes, ((0, 0), (a, a), (b, b)), mode="reflect" if min(planes.shape[1:]) > max(a, b) else "symmetric"
    )
    windows = np.lib.stride_tricks.sliding_window_view(padded, leaves.mask.shape, axis=(1, 2))
    best = np.empty(len(open_v), dtype=planes.dtype)
    for start in range(0, len(open_v), _BLOCK):
        block = np.s_[start : start + _BLOCK]
        shadows = windows[:, open_v[block], open_u[block]].transpose(1, 0, 2, 3)
        best[block] = _best(compare_shadows(shadows, leaves, measure), measure, 1)
    decision[open_v, open_u] = _unit_scale(best, measure)
    return decision


def feature_space(decisions: Sequence[Floating], weights: Sequence[float]) -> Floating:
    """Return the weighted mean of decision spaces (eq. 4.19; the thesis weighs edges K = 2 times gray levels)."""
    shares = np.asarray(weights, dtype=decisions[0].dtype) / sum(weights)
    total = decisions[0] * shares[0]
    for decision, share in zip(decisions[1:], shares[1:], strict=True):
        total += decision * share
    return np.asarray(total)


def threshold_components(space: Floating, budget_px: int) -> tuple[Floating, Floating]:
    """Return centres (n, 2) and scores (n,) of the 8-connected components of the ``budget_px`` best pixels.

    Equations 4.20 to 4.22: histogram-like threshold, connectivity, centroid weighted by value. The score is
    the peak's.
    """
    level = np.partition(space.ravel(), -min(budget_px, space.size))[-min(budget_px, space.size)]
    chosen = (space >= max(level, np.finfo(np.float32).tiny)).astype(np.uint8)
    count, labels = cv2.connectedComponents(chosen, connectivity=8)
    if count <= 1:
        return np.empty((0, 2)), np.empty(0)
    v, u = np.nonzero(chosen)
    of, weight = labels[v, u] - 1, space[v, u].astype(np.float64)
    total = np.bincount(of, weight)
    xy = np.stack([np.bincount(of, weight * u) / total, np.bincount(of, weight * v) / total], axis=1)
    score = np.zeros(count - 1)
    np.maximum.at(score, of, weight)
    order = np.argsort(-score, kind="stable")
    return xy[order], score[order]


def peaks(space: Floating, budget: int, radius: int, floor: float) -> tuple[Floating, Floating]:
    """Return centres (n, 2) and scores (n,) of the ``budget`` highest local maxima above ``floor``, best first.

    A maximum is the highest value within ``radius`` pixels (non-maximal suppression); its sub-pixel place is
    the vertex of the parabolas through its neighbours.
    """
    size = 2 * radius + 1
    dilated = cv2.dilate(space, np.ones((size, size), np.uint8), borderType=cv2.BORDER_REPLICATE)
    top = (space == dilated) & (space > floor)
    top[[0, -1]] = top[:, [0, -1]] = False
    v, u = np.nonzero(top)
    order = np.argsort(-space[v, u], kind="stable")[:budget]
    v, u = v[order], u[order]
    centre = space[v, u].astype(np.float64)
    du = _vertex(space[v, u - 1], centre, space[v, u + 1])
    dv = _vertex(space[v - 1, u], centre, space[v + 1, u])
    return np.stack([u + du, v + dv], axis=1), centre


def _vertex(before: Floating, centre: Floating, after: Floating) -> Floating:
    curvature = before + after - 2 * centre
    shift = 0.5 * (before - after) / np.where(curvature < 0, curvature, -np.inf)
    return np.clip(shift, -0.5, 0.5)


def _best(values: Floating, measure: Measure, axis: int) -> Floating:
    return np.asarray(values.min(axis=axis) if measure is Measure.ED else values.max(axis=axis))


def _unit_scale(values: Floating, measure: Measure) -> Floating:
    if measure in (Measure.CCN, Measure.RHO):
        return np.clip(values, 0, 1, out=values)
    low, high = float(values.min()), float(values.max())
    scaled = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return 1 - scaled if measure is Measure.ED else scaled
