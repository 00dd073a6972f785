"""Complete-link clustering of samples, and the silhouette as the quality of a clustering."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from spinewatch.arrays import Floating, Int


def complete_link(distance: Floating, max_classes: int) -> Int:
    """Return the classes of samples by complete-link clustering.

    Classes are joined in the order of the greatest distance between their members.

    Parameters
    ----------
    distance
        Distances of the samples, shape (m, m).
    max_classes
        Number of classes; fewer result when samples coincide.

    Returns
    -------
    Int
        Class of each sample, numbered from 0, shape (m,).

    Examples
    --------
    >>> points = np.array([0.0, 1.0, 10.0])
    >>> complete_link(np.abs(np.subtract.outer(points, points)), 2)
    array([0, 0, 1])
    """
    tree = linkage(squareform(distance, checks=False), "complete")
    return np.unique(fcluster(tree, max_classes, "maxclust"), return_inverse=True)[1]


def silhouette(distance: Floating, labels: Int) -> float:
    """Return the mean silhouette of a clustering.

    Parameters
    ----------
    distance
        Distances of the samples, shape (m, m).
    labels
        Class of each sample, numbered from 0, shape (m,).

    Returns
    -------
    float
        Mean of ``(b - a) / max(a, b)``, in [-1, 1], where a is a sample's mean distance from the others of its class
        and b that from the nearest other class. A sample alone in its class counts 0; a single class has 0.

    References
    ----------
    P. J. Rousseeuw, Silhouettes, J. Comput. Appl. Math. 20, 1987.

    Examples
    --------
    >>> points = np.array([0.0, 1.0, 4.0])
    >>> round(silhouette(np.abs(np.subtract.outer(points, points)), np.array([0, 0, 1])), 3)
    0.472
    """
    member = np.eye(int(labels.max()) + 1)[labels]
    size = member.sum(axis=0)
    if len(size) < 2:
        return 0.0
    total = distance @ member
    own = total[member > 0] / np.maximum(size[labels] - 1, 1)
    other = np.where(member > 0, np.inf, total / size).min(axis=1)
    longer = np.maximum(np.maximum(own, other), np.finfo(np.float64).tiny)
    return float(np.where(size[labels] > 1, (other - own) / longer, 0.0).mean())
