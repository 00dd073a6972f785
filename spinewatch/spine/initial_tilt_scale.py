"""Whether the tilts of initial poses have the size that the line of their centroids shows: zeros, halves, doubles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int

_LEVEL_DEG = 1e-6
"""Greatest tilt of rounding."""


@dataclass(frozen=True)
class TiltScaleParameters:
    """How the size of tilts is compared with the line of the centroids.

    Of 6,000 sound simulated spines of 2 to 17 vertebrae with errors of 6 degrees and 2 mm, whose axes are turned by up
    to 10 degrees, 2 are flagged. With tilts over more than 30 degrees and poses of all or of 3 to 8 vertebrae, coronal
    tilts of 0 are seen in 81%, halved ones in 34%, doubled ones in 76%.

    Attributes
    ----------
    window_levels
        Greatest number of levels that a direction of the line is taken over. Over one level, 25 mm, an error of 2 mm
        turns it by 6 degrees; over four by 1.6.
    tilt_sd_deg
        Standard deviation of the tilt of a vertebra from the line, degrees: of its end plates and of reading them.
    position_sd_mm
        Standard deviation of a centroid across the line, mm.
    gap_sd_deg
        Standard deviation of the mean of two tilts from that of all between them, degrees for a gap of one level; it
        grows with the square of the gap. A curve of 50 degrees over six levels has up to 0.5.
    min_slope, max_slope
        Tilts per direction of the line that are doubtful beyond; 1 is right.
    axes_sd_deg
        Standard deviation of the rotation about cephalad between the axes of tilts and positions, degrees; it brings a
        part of the other plane in.
    sigma
        How many deviations the slope must differ from 1 by.
    min_bend_deg
        Range of the directions of the line that tilts which are all 0 contradict, degrees.
    max_noise_share
        Greatest part of the variation of the directions that errors of the centroids may make.
    """

    window_levels: int = 4
    tilt_sd_deg: float = 6.0
    position_sd_mm: float = 2.0
    gap_sd_deg: float = 0.6
    axes_sd_deg: float = 8.0
    min_slope: float = 0.65
    max_slope: float = 1.6
    sigma: float = 3.3
    min_bend_deg: float = 10.0
    max_noise_share: float = 0.25


def directions_deg(upwards_mm: Float) -> Float:
    """Return the tilts that vertebrae along some steps have.

    Parameters
    ----------
    upwards_mm
        Steps from a lower to an upper centroid, patient axes, shape (m, 3), mm.

    Returns
    -------
    Float
        Coronal and sagittal direction, shape (m, 2), degrees, with the signs of `tilts_of`.

    Examples
    --------
    >>> import numpy as np
    >>> directions_deg(np.array([[0.0, -10.0, 10.0]])) + 0.0
    array([[45.,  0.]])
    """
    return np.asarray(np.degrees(np.arctan2(upwards_mm[:, [1, 0]] * (-1.0, 1.0), upwards_mm[:, 2:])))


def tilt_scale_doubt(
    numbers: Int,
    position_mm: Float,
    tilt_deg: Float,
    plane: int,
    stated_sd: Float | None = None,
    parameters: TiltScaleParameters | None = None,
) -> str | None:
    """Return what is wrong with the size of the tilts in one plane.

    The mean tilt over up to ``window_levels`` is compared with the direction of the line over the same levels, which it
    is without errors. The slope of the one against the other is 1; a tilt that is common to all does not matter.

    Parameters
    ----------
    numbers
        Places of the n vertebrae in the anatomical sequence, from cranial to caudal, shape (n,).
    position_mm
        Centroids, patient axes, shape (n, 3), mm.
    tilt_deg
        Tilts in the plane, shape (n,), degrees.
    plane
        0 for the coronal plane, 1 for the sagittal one.
    stated_sd
        Stated standard deviations of positions (mm) and rotations (degrees), shape (n, 2); they count where they exceed
        those of the parameters.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    str or None
        A clause for the detail of a flag; None where nothing is doubtful, or too little is known.

    Examples
    --------
    >>> import numpy as np
    >>> tilt = np.linspace(40.0, -40.0, 9)
    >>> left = np.cumsum(25 * np.tan(np.radians([0.0, *(tilt[1:] + tilt[:-1]) / 2])))
    >>> position = np.stack([np.zeros(9), left, np.arange(9)[::-1] * 25.0], axis=1)
    >>> [tilt_scale_doubt(np.arange(9), position, scale * tilt, 0) is None for scale in (1.0, 0.5)]
    [True, False]
    """
    p = parameters or TiltScaleParameters()
    windows = _windows(numbers, p.window_levels)
    if len(windows) < 2 or (position_mm[windows[:, 0], 2] <= position_mm[windows[:, 1], 2]).any():
        return None
    sd = np.tile([p.position_sd_mm, p.tilt_sd_deg], (len(numbers), 1))
    if stated_sd is not None:
        sd = np.maximum(sd, stated_sd)
    mean, gaps, ends = _weights(windows, numbers, position_mm[:, 2], p.gap_sd_deg)
    line = directions_deg(position_mm[windows[:, 0]] - position_mm[windows[:, 1]])
    about_mean = (line - line.mean(axis=0))[:, plane]
    of_centroids, of_tilts = ends * sd[:, 0], mean * sd[:, 1]
    noise = float((of_centroids**2).sum() - (of_centroids.sum(axis=0) ** 2).sum() / len(line))
    total = float(about_mean @ about_mean)
    if total == 0 or noise > p.max_noise_share * total:
        return None
    if (np.abs(tilt_deg) <= _LEVEL_DEG).all():
        bend = float(np.ptp(line[:, plane]))
        if bend <= p.min_bend_deg:
            return None
        return f"are all 0, and the line of the centroids bends by {bend:.0f} degrees; give the tilt of every vertebra"
    of_axes = np.radians(p.axes_sd_deg) * line[:, [1 - plane]]
    F = np.concatenate([of_tilts, of_centroids, gaps, of_axes], axis=1)
    # Errors of the centroids enlarge the variation of the directions.
    slope = float(about_mean @ (mean @ tilt_deg)) / (total - noise)
    slope_sd = float(np.linalg.norm(about_mean @ F)) / (total - noise)
    if p.min_slope <= slope <= p.max_slope or abs(slope - 1) <= p.sigma * slope_sd:
        return None
    return (
        f"are {slope:.2f} ± {slope_sd:.2f} times those of the line of the centroids, where 1 is right; check that every"
        " tilt was read, in full and in degrees, and the unit of the positions"
    )


def _windows(numbers: Int, levels: int) -> Int:
    """Return first and last place of runs of vertebrae over up to some levels, none inside another, shape (m, 2)."""
    last = np.searchsorted(numbers, np.asarray(numbers) + levels, side="right") - 1
    first = np.arange(len(numbers))
    kept = (last > first) & (np.diff(last, prepend=-1) > 0)
    return np.stack([first[kept], last[kept]], axis=1)


def _weights(windows: Int, numbers: Int, along_mm: Float, gap_sd_deg: float) -> tuple[Float, Float, Float]:
    """Return by window: weights of the tilts in the mean (m, n), errors of gaps (m, n - 1), errors by centroid (m, n).

    The last are degrees per mm.
    """
    m, n = len(windows), len(numbers)
    steps = -np.diff(along_mm)
    inside = (windows[:, :1] <= np.arange(n - 1)) & (np.arange(n - 1) < windows[:, 1:])
    share = inside * steps / (inside @ steps)[:, None]
    mean = np.zeros((m, n))
    mean[:, :-1] += share / 2
    mean[:, 1:] += share / 2
    ends = np.zeros((m, n))
    per_mm = np.degrees(1.0 / (inside @ steps))
    ends[np.arange(m), windows[:, 0]] = per_mm
    ends[np.arange(m), windows[:, 1]] = -per_mm
    return mean, share * gap_sd_deg * np.diff(numbers) ** 2, ends
