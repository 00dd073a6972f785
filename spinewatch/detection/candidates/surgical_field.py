"""The surgical field: the part of an image that is searched (thesis section 4.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Bool, Floating


@dataclass(frozen=True)
class SurgicalField:
    """A half-open box of pixels: u0 <= u < u1, v0 <= v < v1.

    Attributes
    ----------
    u0, v0
        First column and row, px.
    u1, v1
        Column and row after the last, px.
    """

    u0: int
    v0: int
    u1: int
    v1: int

    @property
    def height_px(self) -> int:
        """Number of rows."""
        return self.v1 - self.v0

    def contains(self, xy_px: Floating) -> Bool:
        """Return which points lie in the field.

        Parameters
        ----------
        xy_px
            Points (u, v), shape (n, 2), px.

        Returns
        -------
        Bool
            Mask, shape (n,).
        """
        u, v = xy_px[:, 0], xy_px[:, 1]
        return np.asarray((u >= self.u0) & (u < self.u1) & (v >= self.v0) & (v < self.v1))


@dataclass(frozen=True)
class FieldParameters:
    """Parameters of `surgical_field`.

    Attributes
    ----------
    segment_px
        Rows or columns of a segment; the thesis took 5 for a ball of 10 to 11 px.
    alpha
        Fraction of the range of the segments' statistic above the threshold (eq. 4.3; 0.5 in the thesis).
    smoothing
        Segments over which the statistic is averaged.
    margin
        Segments added on each side.
    min_mode_weight
        Least excess of a mode over the threshold, summed over its segments, as a fraction of the greatest mode's.
    """

    segment_px: int = 5
    alpha: float = 0.8
    smoothing: int = 5
    margin: int = 4
    min_mode_weight: float = 0.1


def surgical_field(activity: Floating, parameters: FieldParameters) -> SurgicalField:
    """Return the surgical field of an image: wounds have texture, drapes and skin are smooth.

    Parameters
    ----------
    activity
        Magnitude of the gradient of the log image, shape (H, W).
    parameters
        Size of segments and threshold.

    Returns
    -------
    SurgicalField
        Field, px.

    References
    ----------
    Thesis section 4.2.2, eq. 4.3: segments are ranked by one statistic and thresholded. Departures: the statistic is
    the mean gradient of the log image, because the spread of gray levels within whole rows follows drapes and
    instruments more than the wound. Columns are cut as well as rows, because a spine may lie along either. The field
    extends over all modes of some weight, not only that of the highest peak, because triads on an even ground are
    separate modes. A margin is added.

    Examples
    --------
    >>> activity = np.ones((200, 300))
    >>> activity[80:130, 60:240] = 10
    >>> surgical_field(activity, FieldParameters())
    SurgicalField(u0=30, v0=55, u1=265, v1=155)
    """
    (v0, v1), (u0, u1) = (_extent(activity, axis, parameters) for axis in (0, 1))
    return SurgicalField(u0, v0, u1, v1)


def segment_statistics(image: Floating, axis: int, segment_px: int) -> tuple[Floating, Floating]:
    """Return mean and standard deviation of segments of an image.

    Parameters
    ----------
    image
        Gray levels, shape (H, W).
    axis
        0 for segments of rows, 1 for segments of columns.
    segment_px
        Rows or columns of a segment, px.

    Returns
    -------
    mean, sd : Floating
        One value per segment; the last segment may be shorter.

    References
    ----------
    Thesis figs 4.8 and 4.10.
    """
    mean = segment_means(image, axis, segment_px)
    square = segment_means(np.square(image, dtype=np.float64), axis, segment_px)
    return mean, np.sqrt(np.maximum(square - mean**2, 0))


def segment_means(image: Floating, axis: int, segment_px: int) -> Floating:
    """Return the means of segments of an image.

    Parameters
    ----------
    image
        Gray levels, shape (H, W).
    axis
        0 for segments of rows, 1 for segments of columns.
    segment_px
        Rows or columns of a segment, px.

    Returns
    -------
    Floating
        One mean per segment; the last segment may be shorter.
    """
    first = np.arange(0, image.shape[axis], segment_px)
    count = np.diff(np.append(first, image.shape[axis])) * image.shape[1 - axis]
    depth = cv2.CV_32F if image.dtype == np.float32 else cv2.CV_64F
    lines = cv2.reduce(image, 1 - axis, cv2.REDUCE_SUM, dtype=depth).ravel()
    return np.asarray(np.add.reduceat(lines, first) / count)


def threshold(statistic: Floating, alpha: float) -> float:
    """Return the threshold of a statistic.

    Parameters
    ----------
    statistic
        One value per segment.
    alpha
        Fraction of the range of the statistic above the threshold.

    Returns
    -------
    float
        ``max - alpha (max - min)``.

    References
    ----------
    Thesis eq. 4.3.
    """
    return float(statistic.max() - alpha * np.ptp(statistic))


def modes(statistic: Floating, level: float) -> list[tuple[int, int]]:
    """Return the runs of segments above a level.

    Parameters
    ----------
    statistic
        One value per segment.
    level
        Level that the values of a run exceed.

    Returns
    -------
    list of tuple of int
        First segment of each run and the one after its last.
    """
    above = np.concatenate([[0], (statistic > level).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(above)).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in edges]


def _extent(activity: Floating, axis: int, parameters: FieldParameters) -> tuple[int, int]:
    """Return the first row (axis 0) or column (axis 1) of the field and the one after its last, px."""
    length = activity.shape[axis]
    mean = segment_means(activity, axis, parameters.segment_px)
    width = min(parameters.smoothing, len(mean)) // 2
    smooth = np.convolve(np.pad(mean, width, "edge"), np.ones(2 * width + 1) / (2 * width + 1), "valid")
    level = threshold(smooth, parameters.alpha)
    found = modes(smooth, level)
    if not found:
        return 0, length
    weight = np.array([(smooth[slice(*mode)] - level).sum() for mode in found])
    heavy = np.flatnonzero(weight >= parameters.min_mode_weight * weight.max())
    first = max(found[heavy[0]][0] - parameters.margin, 0) * parameters.segment_px
    return first, min((found[heavy[-1]][1] + parameters.margin) * parameters.segment_px, length)
