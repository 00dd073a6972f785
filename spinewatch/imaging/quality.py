"""Quality of images: what compression, interlacing, bands, noise and damage leave in the gray levels.

The measures need no balls and are computed from the image at 8 bits. Blur, which is measured at the balls, is in
`spinewatch.imaging.sharpness`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from statistics import median
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Float, Single
from spinewatch.flags import Flag

_BLOCK = 8
_MIN_SIDE_PX = 64
_NORMAL_QUARTILE = 0.6745
_NOISE_KERNEL = np.array([1, -2, 1], np.float32)
_NOISE_GAIN = 6.0

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class QualityParameters:
    """Thresholds of `assess_image`, and by how much deviations grow.

    Attributes
    ----------
    max_blockiness
        Largest blockiness of an image that was not compressed; sound images have at most 1.02, JPEG of quality 90 1.10.
    blockiness_sd_gain
        Relative growth of the deviations of centres per unit of blockiness above 1, measured on JPEG of quality 20 to
        92.
    min_step_levels
        Least step of the gray levels along a whole row of blocks, in raster order, of a damaged JPEG.
    min_step_share
        Least share of that step in the absolute steps of the row of blocks.
    min_step_ratio
        Least ratio of that step to the steps along rows that are no borders of blocks.
    max_comb
        Largest difference of a row to its neighbours, over the difference of the neighbours: 0.87 for pure noise.
    min_row_pairing
        Least ratio of the differences within pairs of rows to those between pairs; 0 when rows are doubled.
    interlaced_sd_px
        Standard deviations (u, v) added to centres in an interlaced image, px, measured on fields 2 px apart and on
        doubled rows.
    min_band_cycles
        Least number of bands per image.
    min_band_amplitude
        Least amplitude of bands, as a fraction of the brightness.
    min_band_ratio
        Least ratio of that amplitude to its standard error over the width of the image.
    n_strips
        Number of parts of the width of the image in which bands are measured.
    max_noise_levels
        Largest standard deviation of the noise, gray levels.
    min_levels_share
        Least share of the gray levels between the 1st and the 99th percentile that occur.
    flat_px
        Width and height of an area of one gray level, which noise makes impossible.
    min_flat_noise_levels
        Noise from which such an area means damage, gray levels.
    flat_margin_levels
        Distance from black and from the brightest level that such an area must have.
    max_exposure_ratio
        Largest ratio of the median gray levels of both views.
    min_ball_score
        Score of a feature that counts as a ball in the test for a negative.
    min_balls
        Images with fewer balls are tested for a negative, which must have as many.
    min_negative_ratio
        Least ratio of the balls of the negative to those of the image.
    """

    max_blockiness: float = 1.08
    blockiness_sd_gain: float = 0.1
    min_step_levels: float = 10.0
    min_step_share: float = 0.8
    min_step_ratio: float = 2.0
    max_comb: float = 0.95
    min_row_pairing: float = 0.5
    interlaced_sd_px: tuple[float, float] = (1.0, 0.5)
    min_band_cycles: int = 4
    min_band_amplitude: float = 0.3
    min_band_ratio: float = 4.0
    n_strips: int = 6
    max_noise_levels: float = 7.0
    min_levels_share: float = 0.3
    flat_px: tuple[int, int] = (32, 8)
    min_flat_noise_levels: float = 0.7
    flat_margin_levels: int = 8
    max_exposure_ratio: float = 1.6
    min_ball_score: float = 0.62
    min_balls: int = 6
    min_negative_ratio: float = 3.0


@dataclass(frozen=True)
class ImageQuality:
    """Quality of an image: flags, and how much less certain the centres in it are.

    Attributes
    ----------
    flags
        Flags of the image.
    sd_factor
        Factor of the deviations of centres; 1 for a sound image.
    extra_sd_px
        Standard deviations (u, v) added in square to those of centres, px; 0 for a sound image.
    """

    flags: tuple[Flag, ...] = ()
    sd_factor: float = 1.0
    extra_sd_px: tuple[float, float] = (0.0, 0.0)


SOUND = ImageQuality()
"""Quality of a sound image."""


def assess_image(gray: Single, parameters: QualityParameters) -> ImageQuality:
    """Return the quality of an image.

    Parameters
    ----------
    gray
        Gray levels of 0..255 as stored, without correction, shape (H, W).
    parameters
        Thresholds.

    Returns
    -------
    ImageQuality
        Flags and growth of the deviations.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(120, 3, (64, 96)).astype(np.float32)
    >>> assess_image(noise, QualityParameters()).flags
    ()
    >>> [flag.code for flag in assess_image(np.repeat(noise[::2], 2, axis=0), QualityParameters()).flags]
    ['image-interlaced']
    """
    p, levels = parameters, np.rint(gray).astype(np.uint8)
    if min(levels.shape) < _MIN_SIDE_PX:
        return SOUND
    flags, factor, extra_sd_px = [], 1.0, (0.0, 0.0)
    blocks, noise = blockiness(levels), noise_levels(levels)
    # A small image has few columns per phase, so that chance alone makes a larger ratio.
    if blocks > p.max_blockiness + 8 / np.sqrt(levels.size):
        factor += p.blockiness_sd_gain * (blocks - 1)
        detail = (
            f"JPEG compression: steps at the borders of blocks of 8 px are {blocks:.2f} times those elsewhere (at most"
            f" {p.max_blockiness:g}); send the camera's frame without lossy compression"
        )
        flags.append(Flag("image-compressed", detail))
    damage = _damage(levels, blocks, noise, p)
    if damage:
        flags.append(Flag("image-damaged", f"{damage}; copy or take it again"))
    combed, paired = row_structure(levels)
    if combed > p.max_comb or paired < p.min_row_pairing:
        extra_sd_px = p.interlaced_sd_px
        detail = (
            f"rows differ from their neighbours {combed:.2f} times as much as these from each other (at most"
            f" {p.max_comb:g}), or rows are doubled: pairing {paired:.2f} (at least {p.min_row_pairing:g}); send whole"
            " frames, whose rows are exposed at the same time"
        )
        flags.append(Flag("image-interlaced", detail))
    amplitude, ratio, cycles = bands(levels, p.n_strips, p.min_band_cycles)
    if amplitude > p.min_band_amplitude and ratio > p.min_band_ratio:
        detail = (
            f"{cycles} bands of brightness over the height, of +-{100 * amplitude:.0f}% (at most"
            f" {100 * p.min_band_amplitude:.0f}%); expose for whole periods of the lamps, or use lamps without flicker"
        )
        flags.append(Flag("image-banded", detail))
    if noise > p.max_noise_levels:
        detail = (
            f"noise of {noise:.1f} gray levels (at most {p.max_noise_levels:g}); use more light, less gain"
        )
        flags.append(Flag("image-noisy", detail))
    share = levels_share(levels)
    if share < p.min_levels_share:
        detail = (
            f"{100 * share:.0f}% of the gray levels between black and white occur (at least"
            f" {100 * p.min_levels_share:.0f}%); export the image with 8 bits or more"
        )
        flags.append(Flag("image-coarse", detail))
    return ImageQuality(tuple(flags), factor, extra_sd_px)


def exposure_flags(
    left: Single, right: Single, parameters: QualityParameters
) -> tuple[tuple[Flag, ...], tuple[Flag, ...]]:
    """Return the flags of two views that are not equally exposed.

    Parameters
    ----------
    left, right
        Gray levels of 0..255, shapes (H, W).
    parameters
        Thresholds.

    Returns
    -------
    tuple
        Flags of the left and of the right view: ``exposure-unequal`` for the darker one, or none.

    Examples
    --------
    >>> bright = np.full((8, 8), 150, np.float32)
    >>> left, right = exposure_flags(bright, bright / 3, QualityParameters())
    >>> left, right[0].code
    ((), 'exposure-unequal')
    """
    medians = [float(np.median(gray[::4, ::4])) + 1 for gray in (left, right)]
    ratio = max(medians) / min(medians)
    if ratio <= parameters.max_exposure_ratio:
        return (), ()
    detail = (
        f"the median gray level is {min(medians) - 1:.0f}, that of the other view {max(medians) - 1:.0f}: a ratio of"
        f" {ratio:.1f} (at most {parameters.max_exposure_ratio:g}); expose both alike, look for a covered lens"
    )
    flags = (Flag("exposure-unequal", detail),)
    return (flags, ()) if medians[0] < medians[1] else ((), flags)


def blockiness(levels: Bytes) -> float:
    """Return how much larger third differences are at one of eight phases than at the others.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Mean absolute third difference at the largest phase over the median of the others, or over the opposite
        phase when that is larger; along rows or along columns, whichever is smaller; about 1 without blocks of 8 px.
    """
    return min(_phase_ratio(levels, axis) for axis in (0, 1))


def _phase_ratio(levels: Bytes, axis: int) -> float:
    third = _at_most(_differences(levels, 3, axis), 64)
    profile = cv2.reduce(third, 1 - axis, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel()[2:-3]
    phases = profile[: len(profile) // _BLOCK * _BLOCK].reshape(-1, _BLOCK).mean(axis=0)
    largest = int(phases.argmax())
    # Enlarged images have patterns of 2 or 4 px, which the opposite phase shares.
    others = max(float(median(np.delete(phases, largest).tolist())), float(phases[largest - _BLOCK // 2]))
    return float(phases[largest]) / max(others, 1e-3)


def _differences(levels: Bytes, order: int, axis: int) -> NDArray[Any]:
    """Return the absolute differences of levels (H, W) of some order along an axis, at most 255, uint8."""
    values: NDArray[Any] = levels.astype(np.int16)
    for _ in range(order):
        later, earlier = (values[1:], values[:-1]) if axis == 0 else (values[:, 1:], values[:, :-1])
        values = cv2.subtract(later, earlier)
    return np.asarray(cv2.convertScaleAbs(values))


def _at_most(values: NDArray[Any], limit: int) -> NDArray[Any]:
    """Return values (H, W) cut off at a limit."""
    return cv2.threshold(values, limit, 255, cv2.THRESH_TRUNC)[1]


def row_structure(levels: Bytes) -> tuple[float, float]:
    """Return what tells fields of an interlaced frame from rows of one exposure.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    comb : float
        Difference of rows from the mean of their neighbours over the difference of the neighbours.
    pairing : float
        Smaller over larger of the mean differences of rows 2k, 2k + 1 and of rows 2k + 1, 2k + 2; 0 for doubled rows.
    """
    between = _at_most(cv2.absdiff(levels[2:], levels[:-2]), 30)
    own = _at_most(_differences(levels, 2, axis=0), 60)
    steps = cv2.reduce(cv2.absdiff(levels[1:], levels[:-1]), 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel()
    n = len(steps) // 2 * 2
    even, odd = float(steps[:n:2].mean()), float(steps[1:n:2].mean())
    comb = cv2.mean(own)[0] / 2 / max(cv2.mean(between)[0], 1e-3)
    return comb, min(even, odd) / max(even, odd, 1e-3)


def noise_levels(levels: Bytes) -> float:
    """Return the standard deviation of the noise.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Standard deviation, gray levels: from the median of second differences in both directions, to which edges
        contribute little.

    References
    ----------
    J. Immerkaer, Fast noise variance estimation, 1996; with the median in place of the mean.
    """
    second = cv2.convertScaleAbs(cv2.sepFilter2D(levels, cv2.CV_16S, _NOISE_KERNEL, _NOISE_KERNEL))
    counts = cv2.calcHist([second], [0], None, [256], [0, 256]).ravel().cumsum()
    half = counts[-1] / 2
    index = int(np.searchsorted(counts, half))
    below = float(counts[index - 1]) if index else 0.0
    # The median of whole numbers, between the edges of its bin.
    middle = index - 0.5 + (half - below) / max(float(counts[index]) - below, 1.0)
    return max(0.0, float(middle)) / (_NORMAL_QUARTILE * _NOISE_GAIN)


def bands(levels: Bytes, n_strips: int, min_cycles: int) -> tuple[float, float, int]:
    """Return the strongest periodic band of brightness that is the same over the whole width.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.
    n_strips
        Number of parts of the width that are compared.
    min_cycles
        Least number of bands over the height.

    Returns
    -------
    amplitude : float
        Amplitude as a fraction of the brightness.
    ratio : float
        Amplitude over its standard error, from the differences between strips.
    cycles : int
        Number of bands over the height.
    """
    height = len(levels)
    parts = np.array_split(levels, n_strips, axis=1)
    means = [cv2.reduce(part, 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel() for part in parts]
    strips = np.log(np.stack(means).astype(np.float64) + 4)
    curves, window = _trends_and_window(height)
    strips -= strips @ curves.T @ curves
    waves = np.fft.rfft(strips * window, axis=1)[:, min_cycles : height // _BLOCK] * (2 / window.sum())
    common = waves.mean(axis=0)
    error = np.sqrt((np.abs(waves - common) ** 2).sum(axis=0) / (n_strips * (n_strips - 1))) + 1e-9
    best = int((np.abs(common) - 2 * error).argmax())
    return float(np.abs(common[best])), float(np.abs(common[best]) / error[best]), best + min_cycles


@lru_cache(maxsize=8)
def _trends_and_window(height: int) -> tuple[Float, Float]:
    """Return orthonormal curves (4, H) of the polynomials to the third degree, and a window (H,), for H rows."""
    curves, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, height), 3))
    return np.asarray(curves.T), np.hanning(height)


def levels_share(levels: Bytes) -> float:
    """Return the share of gray levels that occur between the 1st and the 99th percentile.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Share of the levels, 0 to 1; small when an image has fewer than 8 bits.
    """
    counts = cv2.calcHist([levels[::2]], [0], None, [256], [0, 256]).ravel()
    low, high = np.searchsorted(counts.cumsum(), np.array([0.01, 0.99]) * counts.sum())
    return float((counts[low : high + 1] > 0).mean())


def _damage(levels: Bytes, blocks: float, noise: float, p: QualityParameters) -> str:
    """Return what is damaged in an image, empty for a sound one."""
    if blocks > 1 + (p.max_blockiness - 1) / 2:
        step, share = raster_step(levels)
        if step > p.min_step_levels and share > p.min_step_share:
            # Rows next to the borders are left out: the step changes the gradients there.
            others = max(raster_step(levels[offset:])[0] for offset in range(2, _BLOCK - 1))
            if step > p.min_step_ratio * others:
                return f"JPEG damaged: the gray levels jump by {step:.0f} from one block on"
        return ""
    # Every fourth pixel decides whether to examine all of them.
    if noise > p.min_flat_noise_levels and _flat_areas(levels[::4, ::4], 4, p).any():
        flat = np.argwhere(_flat_areas(levels, 1, p))
        if len(flat):
            v, u = flat[0]
            return (
                f"an area of one gray level without noise, near u = {u}, v = {v}: part of the image is lost"
            )
    return ""


def _flat_areas(levels: Bytes, step: int, p: QualityParameters) -> Bool:
    """Return the mask (H, W) of the centres of areas of one gray level in an image of every step-th pixel."""
    width, height = (n // step for n in p.flat_px)
    kernel, levels = np.ones((height, width), np.uint8), np.ascontiguousarray(levels)
    low, high = cv2.erode(levels, kernel), cv2.dilate(levels, kernel)
    margin = p.flat_margin_levels
    return np.asarray((low == high) & (low > margin) & (low < int(levels.max()) - margin))


def raster_step(levels: Bytes) -> tuple[float, float]:
    """Return the largest step of the gray levels between rows of blocks, in raster order of the blocks.

    When the decoder loses its place in a JPEG, all blocks after one are brighter or darker: the step is at the upper
    border of the rest of this row of blocks and of the beginning of the next.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8; blocks begin at the upper left corner.

    Returns
    -------
    step : float
        Mean step over one row of blocks, gray levels.
    share : float
        Step over the mean absolute step there.
    """
    rows, columns = (n // _BLOCK for n in levels.shape)
    blocks = levels[: rows * _BLOCK, : columns * _BLOCK].reshape(rows, _BLOCK, columns * _BLOCK)
    above, below = blocks[:-1, -2:].astype(np.int16), blocks[1:, :2].astype(np.int16)
    step = (below[:, 0] - above[:, 1]) - ((above[:, 1] - above[:, 0]) + (below[:, 1] - below[:, 0])) / 2
    steps = np.median(step.reshape(-1, columns, _BLOCK).clip(-48, 48), axis=2).ravel()
    mean, size = _moving_mean(steps, columns), _moving_mean(np.abs(steps), columns)
    best = int(np.abs(mean).argmax())
    return float(abs(mean[best])), float(abs(mean[best]) / max(size[best], 1e-9))


def _moving_mean(values: Float, n: int) -> Float:
    """Return means (m - n + 1,) of n successive of m values."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[n:] - total[:-n]) / n)
