"""Decision spaces of template trees and their weighted mean, the feature space (thesis section 4.3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.arrays import Floating
from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.similarity import Measure, Templates, compare_windows
from spinewatch.detection.candidates.templates import TemplateTree

_BLOCK = 4096
"""Windows compared at once: they fit the cache, whatever the image."""


def decision_space(planes: Floating, tree: TemplateTree, measure: Measure, gate: float | None) -> Floating:
    """Return the decision space of a template tree.

    Where the similarity of the root is below the gate the value is 0, elsewhere it is the greatest similarity of a
    representative.

    Parameters
    ----------
    planes
        Image in the tree's property space, shape (C, H, W).
    tree
        Roots and representatives of C planes.
    measure
        Measure of similarity; ED, OCC and CCM are scaled to [0, 1] over the image.
    gate
        Threshold on the similarity of the root, in [0, 1]; None for the relaxed mode of section 7.2, in which the
        similarity of the root is the result.

    Returns
    -------
    Floating
        Decision space, shape (H, W), in [0, 1].

    References
    ----------
    Thesis eq. 4.18.
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
        some = windows[:, open_v[block], open_u[block]].transpose(1, 0, 2, 3)
        best[block] = _best(compare_windows(some, leaves, measure), measure, 1)
    decision[open_v, open_u] = _unit_scale(best, measure)
    return decision


def feature_space(decisions: Sequence[Floating], weights: Sequence[float]) -> Floating:
    """Return the weighted mean of decision spaces.

    Parameters
    ----------
    decisions
        Decision spaces, each of shape (H, W).
    weights
        One weight per decision space.

    Returns
    -------
    Floating
        Feature space, shape (H, W).

    References
    ----------
    Thesis eq. 4.19, with the edges weighted K = 2 times the gray levels.

    Examples
    --------
    >>> feature_space([np.array([[0.3]]), np.array([[0.9]])], [1, 2]).round(3)
    array([[0.7]])
    """
    shares = np.asarray(weights, dtype=decisions[0].dtype) / sum(weights)
    total = decisions[0] * shares[0]
    for decision, share in zip(decisions[1:], shares[1:], strict=True):
        total += decision * share
    return np.asarray(total)


def _best(values: Floating, measure: Measure, axis: int) -> Floating:
    """Return the values of the most similar templates along an axis."""
    return np.asarray(values.min(axis=axis) if measure is Measure.ED else values.max(axis=axis))


def _unit_scale(values: Floating, measure: Measure) -> Floating:
    """Return similarities in [0, 1], 1 for the most similar."""
    if measure in (Measure.CCN, Measure.RHO):
        return np.clip(values, 0, 1, out=values)
    low, high = float(values.min()), float(values.max())
    scaled = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return 1 - scaled if measure is Measure.ED else scaled
