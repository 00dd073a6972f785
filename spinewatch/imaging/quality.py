"""Quality of images: what compression, interlacing, bands, noise and damage leave in the gray levels.

The measures need no balls and are computed from the image at 8 bits. Blur, which is measured at the balls, is in
`spinewatch.imaging.sharpness`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from spinewatch.arrays import Bool, Single
from spinewatch.flags import Flag
from spinewatch.imaging.bands import bands
from spinewatch.imaging.displaced_rows import RowDisplacementParameters, displaced_rows
from spinewatch.imaging.jpeg_blocks import BLOCK_PX, blockiness, raster_step
from spinewatch.imaging.level_differences import Bytes
from spinewatch.imaging.noise import levels_share, noise_levels
from spinewatch.imaging.row_structure import row_structure

_MIN_SIDE_PX = 64
_CHANCE_BLOCKINESS = 8.0
"""Margin of the blockiness for chance, over one over the square root of the number of pixels.

A small image has few differences per phase, so that chance alone makes a larger ratio. In pure noise the relative
standard error of the mean over one of eight phases is about two over that root; the margin is four times that.
"""


@dataclass(frozen=True)
class QualityParameters:
    """Thresholds of `assess_image`, `exposure_flags` and the test for a negative, and by how much deviations grow.

    The test for a negative is `spinewatch.detection.negative.is_negative`. docs/image-quality.md has the measures of
    sound and of degraded images.

    Attributes
    ----------
    max_blockiness
        Largest blockiness of an image that was not compressed.
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
        Largest difference of a row to its neighbours, over the difference of the neighbours.
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
    displaced_rows
        Thresholds of rows that are displaced to the side.
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
    displaced_rows: RowDisplacementParameters = field(default_factory=RowDisplacementParameters)
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
    if blocks > p.max_blockiness + _CHANCE_BLOCKINESS / np.sqrt(levels.size):
        factor += p.blockiness_sd_gain * (blocks - 1)
        detail = (
            f"JPEG compression: steps at the borders of blocks of 8 px are {blocks:.2f} times those elsewhere (at most"
            f" {p.max_blockiness:g}); send the camera's frame without lossy compression"
        )
        flags.append(Flag("image-compressed", detail))
    damage = _damage(levels, blocks, noise, p)
    if damage:
        flags.append(Flag("image-damaged", f"{damage}; copy or take it again"))
    jump = displaced_rows(levels, p.displaced_rows)
    if jump is not None:
        detail = (
            f"from row v = {jump.row} on the rows are displaced by {jump.shift_px:+d} px: this row and the one above"
            f" correlate by {jump.before:.2f} as they are and by {jump.after:.2f} without the displacement; every depth"
            " in these rows is wrong; take the image again, and look at the cable and the frame grabber"
        )
        flags.append(Flag("image-damaged", detail))
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


def _damage(levels: Bytes, blocks: float, noise: float, p: QualityParameters) -> str:
    """Return what is damaged in an image, empty for a sound one."""
    if blocks > 1 + (p.max_blockiness - 1) / 2:
        step, share = raster_step(levels)
        if step > p.min_step_levels and share > p.min_step_share:
            # Rows next to the borders are left out: the step changes the gradients there.
            others = max(raster_step(levels[offset:])[0] for offset in range(2, BLOCK_PX - 1))
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
