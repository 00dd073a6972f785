"""Classes of samples: complete-link clustering, and the silhouette that tells a good cut from a bad one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from spinewatch.arrays import Floating

Labels = NDArray[np.intp]


def complete_link(distance: Floating, count: int) -> Labels:
    """Return the class (m,), numbered from 0, of each sample with distances (m, m), in at most ``count`` classes.

    Classes are joined in the order of the greatest distance between their members. There are fewer classes than
    asked for when samples coincide.
    """
    tree = linkage(squareform(distance, checks=False), "complete")
    return np.unique(fcluster(tree, count, "maxclust"), return_inverse=True)[1]


def silhouette(distance: Floating, labels: Labels) -> float:
    """Return the mean of (b - a) / max(a, b) over samples with distances (m, m) and classes (m,) numbered from 0.

    a is a sample's mean distance from the others of its class, b that from the nearest other class (Rousseeuw 1987).
    A sample alone in its class counts 0, and so does everything when there is but one class.
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
