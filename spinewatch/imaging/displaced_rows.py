"""Rows of an image that are displaced to the side from one row on, as faults of a frame grabber leave them.

Neighbouring rows show nearly the same. Where they do not, an object may end there; then no displacement of one of them
makes them correlate. docs/image-quality.md has how many displacements are found, and false alarms.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Bool, Single
from spinewatch.imaging.level_differences import Bytes

_BAND_ROWS = 64
"""Rows that are compared at a time: of a whole image the products would be many times its size."""
_RIVAL_PX = 2
"""Displacements this near to the best one are no rivals of it."""


@dataclass(frozen=True)
class RowDisplacementParameters:
    """Thresholds of `displaced_rows`.

    Attributes
    ----------
    max_lag_px
        Largest displacement that is looked for, px.
    n_parts
        Number of parts of the width that are compared, each by its own correlation.
    min_part_px
        Least width of a part; a narrower image is not judged.
    detail_px
        Width of the mean along a row that is taken off the gray levels, px.
    n_near
        Rows before and after that say how well neighbouring rows correlate here.
    min_correlation
        Least correlation of neighbouring rows of a part that has texture.
    min_textured
        Least share of the parts that must have texture.
    min_drop
        Least drop of the correlation between two rows, in half of the parts with texture.
    min_gain
        Least gain of the correlation by the displacement.
    min_excess
        Least gain over what the same displacement gains between the rows near: it gains there, too, where texture is
        oblique.
    min_share
        Least share of the correlation of the rows near that the displacement restores: it restores none at the edge of
        an object.
    min_restored
        Least correlation that the displacement restores: noise alone reaches 0.3 at the best of all displacements.
    max_rival
        Largest share that a displacement by 3 px more or less restores: it restores as much in a periodic texture.
    max_examined
        Largest number of pairs of rows that are compared at every displacement, those with the largest drop first.
    """

    max_lag_px: int = 32
    n_parts: int = 12
    min_part_px: int = 24
    detail_px: int = 9
    n_near: int = 4
    min_correlation: float = 0.25
    min_textured: float = 0.5
    min_drop: float = 0.12
    min_gain: float = 0.15
    min_excess: float = 0.4
    min_share: float = 0.7
    min_restored: float = 0.4
    max_rival: float = 0.75
    max_examined: int = 16


@dataclass(frozen=True)
class RowDisplacement:
    """Displacement of the rows of an image from one row on.

    Attributes
    ----------
    row
        First displaced row.
    shift_px
        Displacement against the row above, px, positive to the right.
    before, after
        Correlation of the two rows as they are, and with the displacement undone.
    """

    row: int
    shift_px: int
    before: float
    after: float


def displaced_rows(levels: Bytes, parameters: RowDisplacementParameters) -> RowDisplacement | None:
    """Return where the rows of an image jump to the side.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.
    parameters
        Thresholds.

    Returns
    -------
    RowDisplacement or None
        The clearest jump; None without one, or in an image too narrow to tell.

    Examples
    --------
    >>> texture = cv2.blur(np.random.default_rng(0).normal(120, 80, (90, 400)), (3, 3))
    >>> torn = np.vstack([texture[:50], np.roll(texture[50:], 4, axis=1)]).astype(np.uint8)
    >>> found = displaced_rows(torn, RowDisplacementParameters())
    >>> found.row, found.shift_px
    (50, 4)
    >>> displaced_rows(texture.astype(np.uint8), RowDisplacementParameters()) is None
    True
    """
    p = parameters
    height, width = levels.shape
    part = (width - 2 * p.max_lag_px) // p.n_parts
    if part < p.min_part_px or height < 4 * p.n_near:
        return None
    bands = [levels[start : start + _BAND_ROWS + 1] for start in range(0, height - 1, _BAND_ROWS)]
    usual = np.concatenate([_neighbour_correlation(band, part, p) for band in bands])
    near = cv2.blur(usual, (1, 2 * p.n_near + 1))
    textured = near > p.min_correlation
    count = textured.sum(axis=1)
    fallen = (textured & (near - usual > p.min_drop)).sum(axis=1)
    suspect = (count >= p.min_textured * p.n_parts) & (2 * fallen > count)
    suspect[: p.n_near] = suspect[len(suspect) - p.n_near :] = False
    pairs = np.flatnonzero(suspect)
    pairs = pairs[np.argsort(-fallen[pairs] / count[pairs], kind="stable")][: p.max_examined]
    found = []
    for above in pairs:
        rows = _detail(levels[above - p.n_near : above + p.n_near + 2], p)
        jump = _jump(rows, near[above], textured[above], part, p)
        if jump is not None:
            found.append(RowDisplacement(int(above) + 1, *jump))
    return max(found, key=lambda jump: jump.after - jump.before, default=None)


def _detail(levels: Bytes, p: RowDisplacementParameters) -> Single:
    """Return gray levels (n, W) less their means along the rows."""
    gray = levels.astype(np.float32)
    return np.asarray(gray - cv2.blur(gray, (p.detail_px, 1)))


def _neighbour_correlation(levels: Bytes, part: int, p: RowDisplacementParameters) -> Single:
    """Return the correlations (n - 1, n_parts) of neighbouring rows (n, W)."""
    first = _detail(levels, p)[:, p.max_lag_px :][:, : p.n_parts * part]
    energy = _sums(first * first, part)
    return np.asarray(_sums(first[1:] * first[:-1], part) / np.sqrt(energy[1:] * energy[:-1] + 1))


def _sums(values: Single, part: int) -> Single:
    """Return the sums (n, k) over parts of rows (n, k * part)."""
    return np.asarray(np.add.reduceat(values, np.arange(0, values.shape[1], part), axis=1))


def _jump(
    rows: Single, near: Single, textured: Bool, part: int, p: RowDisplacementParameters
) -> tuple[int, float, float] | None:
    """Return the displacement of the second of the two middle rows, and the correlation of both before and after.

    ``rows`` are these two and ``n_near`` rows on either side, shape (2 n_near + 2, W); ``near`` is the usual
    correlation in each part and ``textured`` whether it has texture, shapes (n_parts,). None without a displacement.
    """
    lags = np.arange(-p.max_lag_px, p.max_lag_px + 1)
    starts = p.max_lag_px + part * np.flatnonzero(textured)
    windows = np.lib.stride_tricks.sliding_window_view(rows, part, axis=1)
    unmoved = windows[:, starts]
    moved = windows[p.n_near + 1, starts[:, None] + lags]
    correlation = _correlation(unmoved[p.n_near, :, None], moved)
    gain = np.median(correlation - correlation[:, lags == 0], axis=0)
    best = int(np.where(lags == 0, -np.inf, gain).argmax())
    share = np.median(correlation / near[textured, None], axis=0)
    rival = share[np.abs(lags - lags[best]) > _RIVAL_PX].max()
    before, after = np.median(correlation[:, [p.max_lag_px, best]], axis=0)
    if gain[best] < p.min_gain or share[best] < p.min_share or rival > p.max_rival * share[best]:
        return None
    same = _correlation(unmoved[:-1], windows[1:, starts + lags[best]])
    others = np.delete(np.median(same - _correlation(unmoved[:-1], unmoved[1:]), axis=1), p.n_near)
    if after < p.min_restored or gain[best] - np.median(others) < p.min_excess:
        return None
    return int(lags[best]), float(before), float(after)


def _correlation(a: Single, b: Single) -> Single:
    """Return the correlations of windows (..., n) of details."""
    power = (a * a).sum(axis=-1) * (b * b).sum(axis=-1)
    return np.asarray((a * b).sum(axis=-1) / np.sqrt(power + 1))
