"""The surgical field: the part of the picture that is worth searching (thesis section 4.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Floating


@dataclass(frozen=True)
class SurgicalField:
    """A half-open box of pixels: u0 <= u < u1, v0 <= v < v1."""

    u0: int
    v0: int
    u1: int
    v1: int

    @property
    def height_px(self) -> int:
        """Number of rows."""
        return self.v1 - self.v0

    def contains(self, xy_px: Floating) -> NDArray[np.bool_]:
        """Tell of each point (n, 2) whether it lies in the field."""
        u, v = xy_px[:, 0], xy_px[:, 1]
        return (u >= self.u0) & (u < self.u1) & (v >= self.v0) & (v < self.v1)


@dataclass(frozen=True)
class FieldParameters:
    """Parameters of ``surgical_field``.

    ``segment_px``: rows (or columns) of a segment; the thesis took 5 for a ball of 10 to 11 pixels.
    ``alpha``: fraction of the range of the segments' statistic that counts as field (eq. 4.3; 0.5 in the
    thesis). ``smoothing`` and ``margin``: segments over which the statistic is averaged, and that are added
    on each side. ``kept``: modes count whose excess over the level, summed over their segments, is this fraction of
    the greatest.
    """

    segment_px: int = 5
    alpha: float = 0.8
    smoothing: int = 5
    margin: int = 4
    kept: float = 0.1


def surgical_field(activity: Floating, parameters: FieldParameters) -> SurgicalField:
    """Return the field of an activity image (H, W): the wound is busy, drapes and skin are smooth.

    As in the thesis, segments are ranked by one statistic and thresholded by eq. 4.3.
    Departures: the statistic is the mean gradient of the log image, since the spread of gray levels within
    whole rows follows drapes and instruments more than the wound; columns are cut as well as rows, since a
    spine may lie along either; all between the outermost modes of some weight is kept, not the one with the highest
    peak, since triads on an even ground are modes of their own; and a margin is added.
    """
    (v0, v1), (u0, u1) = (_extent(activity, axis, parameters) for axis in (0, 1))
    return SurgicalField(u0, v0, u1, v1)


def segment_statistics(image: Floating, axis: int, segment_px: int) -> tuple[Floating, Floating]:
    """Return mean and standard deviation of segments of rows (axis 0) or columns (axis 1), as figs 4.8 and 4.10."""
    mean = segment_means(image, axis, segment_px)
    square = segment_means(np.square(image, dtype=np.float64), axis, segment_px)
    return mean, np.sqrt(np.maximum(square - mean**2, 0))


def segment_means(image: Floating, axis: int, segment_px: int) -> Floating:
    """Return the means of segments of rows (axis 0) or columns (axis 1) of an image (H, W)."""
    starts = np.arange(0, image.shape[axis], segment_px)
    count = np.diff(np.append(starts, image.shape[axis])) * image.shape[1 - axis]
    return np.asarray(np.add.reduceat(image.sum(axis=1 - axis, dtype=np.float64), starts) / count)


def threshold(statistic: Floating, alpha: float) -> float:
    """Return ``max - alpha (max - min)`` (eq. 4.3)."""
    return float(statistic.max() - alpha * np.ptp(statistic))


def modes(statistic: Floating, level: float) -> list[tuple[int, int]]:
    """Return the half-open runs of segments above a level."""
    above = np.concatenate([[0], (statistic > level).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(above)).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in edges]


def _extent(activity: Floating, axis: int, parameters: FieldParameters) -> tuple[int, int]:
    length = activity.shape[axis]
    mean = segment_means(activity, axis, parameters.segment_px)
    width = min(parameters.smoothing, len(mean)) // 2
    smooth = np.convolve(np.pad(mean, width, "edge"), np.ones(2 * width + 1) / (2 * width + 1), "valid")
    level = threshold(smooth, parameters.alpha)
    found = modes(smooth, level)
    if not found:
        return 0, length
    excess = np.array([(smooth[slice(*mode)] - level).sum() for mode in found])
    kept = [
        mode for mode, weight in zip(found, excess, strict=True) if weight >= parameters.kept * excess.max()
    ]
    start, stop = kept[0][0], kept[-1][1]
    first = max(start - parameters.margin, 0) * parameters.segment_px
    return first, min((stop + parameters.margin) * parameters.segment_px, length)
