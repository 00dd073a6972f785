"""Preprocessing of DETECT-POINT: gamma correction, size reduction, noise filter and edges (thesis section 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float, Single
from spinewatch.detection.candidates.property_spaces import PropertySpace, property_planes
from spinewatch.imaging.exposure import gamma_correct
from spinewatch.imaging.filters import truncated_median_filter


class SegmentStatistic(StrEnum):
    """The statistic by which segments of an image are ranked."""

    STANDARD_DEVIATION = "standard deviation"
    """The choice of the thesis: the surgical field has the greatest spread of gray levels."""
    MEAN = "mean"
    """Its alternative: the surgical field has the smallest mean gray level; stained drapes have, too."""


@dataclass(frozen=True)
class PreprocessingParameters:
    """Parameters of `preprocess`.

    Attributes
    ----------
    gammas
        Exponents of the gamma corrections, which are always applied.
    segment_rows
        Rows of a segment.
    statistic
        Statistic of the segments; None keeps the whole image.
    alpha
        Fraction of the range of the statistic that passes the threshold (eq. 4.3).
    """

    gammas: tuple[float, ...] = (2.0, 1.5)
    segment_rows: int = 5
    statistic: SegmentStatistic | None = SegmentStatistic.STANDARD_DEVIATION
    alpha: float = 0.5


@dataclass(frozen=True, eq=False)
class Preprocessed:
    """An image in both property spaces.

    Attributes
    ----------
    gray
        Filtered gray levels of the rows of the surgical field, shape (h, W).
    edges
        Sobel magnitudes of the filtered gray levels, shape (h, W).
    rows
        First row of the field in the image, and the row after its last.
    """

    gray: Single
    edges: Single
    rows: tuple[int, int]


@dataclass(frozen=True, eq=False)
class SegmentStatistics:
    """Means and standard deviations of the segments of an image, as in figs 4.8 and 4.10.

    Attributes
    ----------
    first_rows
        First row of each segment, and the number of rows of the image, shape (n + 1,).
    means
        Mean gray levels, shape (n,).
    standard_deviations
        Standard deviations of the gray levels, shape (n,).
    """

    first_rows: Sequence[int]
    means: Float
    standard_deviations: Float


def preprocess(gray: Single, parameters: PreprocessingParameters) -> Preprocessed:
    """Return an image as DETECT-POINT correlates it.

    Parameters
    ----------
    gray
        Gray levels of 0..255, shape (H, W).
    parameters
        Gamma corrections and size reduction.

    Returns
    -------
    Preprocessed
        Gray levels and edges of the surgical field.

    References
    ----------
    Thesis section 4.2, in its order. Gray levels stay real numbers between the steps; the programs of the thesis
    rounded them to 8 bits.

    Examples
    --------
    >>> image = np.full((40, 60), 60, np.float32)
    >>> image[10:20, 5::9] = 20
    >>> preprocess(image, PreprocessingParameters()).rows
    (10, 20)
    """
    for gamma in parameters.gammas:
        gray = gamma_correct(gray, gamma)
    first, last = _field_rows(gray, parameters)
    filtered = truncated_median_filter(gray[first:last])
    return Preprocessed(filtered, property_planes(filtered, PropertySpace.EDGE)[0], (first, last))


def segment_statistics(gray: Single, segment_rows: int) -> SegmentStatistics:
    """Return the statistics of segments of contiguous rows.

    Parameters
    ----------
    gray
        Gray levels, shape (H, W).
    segment_rows
        Rows of a segment; the last segment may have fewer.

    Returns
    -------
    SegmentStatistics
        Means and standard deviations.

    Examples
    --------
    >>> segment_statistics(np.array([[1, 3], [2, 2], [5, 7]], np.float32), 2).means
    array([2., 6.])
    """
    edges = [*range(0, len(gray), segment_rows), len(gray)]
    segments = [gray[a:b].astype(np.float64) for a, b in pairwise(edges)]
    return SegmentStatistics(
        edges, np.array([s.mean() for s in segments]), np.array([s.std() for s in segments])
    )


def _field_rows(gray: Single, parameters: PreprocessingParameters) -> tuple[int, int]:
    """Return the rows of the mode that contains the greatest standard deviation (eq. 4.3)."""
    statistics = segment_statistics(gray, parameters.segment_rows)
    if parameters.statistic is None:
        return 0, len(gray)
    high = statistics.standard_deviations
    if parameters.statistic is SegmentStatistic.MEAN:
        high = -statistics.means
    passing = high >= high.max() - parameters.alpha * np.ptp(high)
    first = last = int(np.argmax(np.where(passing, statistics.standard_deviations, -np.inf)))
    while first > 0 and passing[first - 1]:
        first -= 1
    while last + 1 < len(passing) and passing[last + 1]:
        last += 1
    return statistics.first_rows[first], statistics.first_rows[last + 1]
