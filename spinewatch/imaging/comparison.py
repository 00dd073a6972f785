"""Comparison of two images of one camera: the same exposure, the same scene, or something that has moved."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import cv2
import numpy as np

from spinewatch.arrays import Bool, Float, Pixels, Single
from spinewatch.imaging.tone import scaled, to_gray, white_level
from spinewatch.robust import MAD_TO_SD


@dataclass(frozen=True)
class ComparisonParameters:
    """Parameters of the comparison.

    Attributes
    ----------
    tile_px
        Side of the square tiles whose displacements are estimated, px.
    min_displacement_px
        A tile displaced by more has moved. Breathing and the surgeon's hands move a vertebra by 1 mm and more, about
        1 px of the cart.
    max_displacement_sd_px
        A tile counts when the noise allows to estimate its displacement with this standard deviation, px.
    max_noise_gray
        Largest noise of the difference, gray levels of 0..255: each of two images of a camera has far less than 10.
    max_noise_ratio, max_gradient_ratio
        A tile has changed when the RMS of its residuals exceeds both multiples, of the noise of the difference and of
        the RMS gradient per px of the tile.
    max_changed_fraction
        Largest fraction of counted tiles that may have moved or changed in a repeated image: a time burnt into the
        image, or a defect of transmission. A triad covers more.
    min_counted_fraction
        Smallest fraction of all tiles that must count.
    saturated_gray
        Pixels at or above this gray level (of 255) are left out, because a change of brightness cuts them off.
    sample_step, strip_sample_step
        Step between the pixels with which the change of brightness is estimated, in an image and in a strip, px.
    max_pixels
        Larger images are reduced by a whole factor to at most about as many pixels; all lengths in px are of the
        reduced image.
    strip_margin
        A strip decides when even this multiple of the fraction of its tiles that count, or of the largest that can, is
        too small.
    """

    tile_px: int = 48
    min_displacement_px: float = 0.1
    max_displacement_sd_px: float = 0.025
    max_noise_gray: float = 15.0
    max_noise_ratio: float = 3.0
    max_gradient_ratio: float = 0.5
    max_changed_fraction: float = 0.01
    min_counted_fraction: float = 0.25
    saturated_gray: float = 250.0
    sample_step: int = 3
    strip_sample_step: int = 6
    max_pixels: int = 1_000_000
    strip_margin: float = 2.0


@dataclass(frozen=True)
class ImageComparison:
    """Difference of two images of one camera.

    Attributes
    ----------
    exact
        Whether all pixels are equal.
    repeated
        Whether the second shows the first again: exactly, or all but noise and a change of brightness.
    noise_gray
        Robust standard deviation of the difference after a change of brightness, gray levels of 0..255; NaN when the
        shapes differ.
    displacement_px
        Displacement that at most the tolerated fraction of the counted tiles exceeds, px of the images given; NaN when
        too few tiles count.
    """

    exact: bool
    repeated: bool
    noise_gray: float
    displacement_px: float


@dataclass(frozen=True, eq=False)
class TexturedStrip:
    """A row of tiles of an image, kept to see whether other images may repeat it.

    Attributes
    ----------
    row
        Number of the row of tiles, from the top, from 0.
    pixels
        Its raw gray levels, reduced as the whole image is for a comparison, 8 or 16 bits; shape (``tile_px``, W / n)
        for a reduction by n.
    white
        Level that is white in the image.
    image_shape
        Height and width of the image, px.
    """

    row: int
    pixels: Pixels
    white: int
    image_shape: tuple[int, int]


def compare_images(
    first: Pixels, second: Pixels, parameters: ComparisonParameters | None = None
) -> ImageComparison:
    """Return how two images of one camera differ.

    Two exposures of an unchanged scene differ by noise alone. A camera, cart or patient that has moved displaces
    texture, however small the differences of gray levels are. The second image is fitted to the first one by a gain and
    an offset, and each tile by an offset and a displacement; it is a repetition when tiles neither moved nor changed
    and the noise is no larger than that of cameras.

    Parameters
    ----------
    first, second
        Gray levels, shape (H, W), 8 or 16 bits. Images of different shapes are different.
    parameters
        Parameters; the defaults by default.

    Returns
    -------
    ImageComparison
        The differences.

    Raises
    ------
    ImageError
        If an image is not a gray image of 8 or 16 bits.

    References
    ----------
    Lucas and Kanade, "An iterative image registration technique", IJCAI 1981; one step without iteration, because only
    displacements near zero matter.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> scene = np.kron(rng.uniform(40, 200, (24, 24)), np.ones((8, 8)))
    >>> def exposure(shift: int) -> Pixels:
    ...     return np.rint(np.roll(scene, shift, 1) + rng.normal(0, 2, scene.shape)).astype(np.uint8)
    >>> compare_images(exposure(0), exposure(0)).repeated
    True
    >>> compare_images(exposure(0), exposure(1)).repeated
    False
    """
    p = parameters or ComparisonParameters()
    if first.shape != second.shape:
        return ImageComparison(False, False, float("nan"), float("nan"))
    if np.array_equal(first, second):
        return ImageComparison(True, True, 0.0, 0.0)
    factor = _factor(first.shape, p)
    a, b = to_gray(_reduced(first, factor)), to_gray(_reduced(second, factor))
    valid = (a < p.saturated_gray) & (b < p.saturated_gray)
    sample = (slice(None, None, p.sample_step), slice(None, None, p.sample_step))
    chosen = valid[sample]
    gain, offset, noise = _fit_brightness(a[sample][chosen], b[sample][chosen])
    changed, displacement = _compare_tiles(gain * a, b - offset, valid, noise, p)
    if len(displacement) == 0:
        return ImageComparison(False, False, noise, float("nan"))
    repeated = changed <= p.max_changed_fraction and noise <= p.max_noise_gray
    quantile = float(np.quantile(displacement, 1 - p.max_changed_fraction, method="lower"))
    return ImageComparison(False, repeated, noise, factor * quantile)


def textured_strip(image: Pixels, parameters: ComparisonParameters | None = None) -> TexturedStrip | None:
    """Return the row of tiles of an image that has the most texture.

    Most of its tiles still count, as in `compare_images`, at a noise at which those of other rows do not.

    Parameters
    ----------
    image
        Gray levels, shape (H, W), 8 or 16 bits.
    parameters
        Parameters; the defaults by default.

    Returns
    -------
    TexturedStrip or None
        The row; None when the image is smaller than a tile.

    Raises
    ------
    ImageError
        If the image is not a gray image of 8 or 16 bits.
    """
    p = parameters or ComparisonParameters()
    factor = _factor(image.shape, p)
    rows, columns = _tiles(image.shape, p)
    if rows * columns == 0:
        return None
    used = to_gray(_reduced(image[: rows * p.tile_px * factor, : columns * p.tile_px * factor], factor))
    gu, gv = _sampled_gradient(used, p.sample_step)
    n = _tile_sums(np.ones_like(gu), rows, columns)
    A, _, _ = _covariances(gu, gv, lambda x: _tile_sums(x, rows, columns) / n)
    texture = np.linalg.eigvalsh(A)[:, 0].reshape(rows, columns)
    row = int(np.argmax(np.quantile(texture, 1 - p.min_counted_fraction / p.strip_margin, axis=1)))
    return TexturedStrip(row, _strip(image, row, p), white_level(image), (image.shape[0], image.shape[1]))


def may_be_equal(strip: TexturedStrip, image: Pixels, parameters: ComparisonParameters | None = None) -> bool:
    """Return whether all pixels of two images may be equal, as far as a strip of one shows.

    Parameters
    ----------
    strip
        Strip of the first image.
    image
        Gray levels of the second image, shape (H, W), 8 or 16 bits.
    parameters
        Parameters; the defaults by default.

    Returns
    -------
    bool
        True when the pixels of the strip are equal, or when it has another shape, made with other parameters.
    """
    if strip.image_shape != image.shape:
        return False
    shown = _strip(image, strip.row, parameters or ComparisonParameters())
    return shown.shape != strip.pixels.shape or np.array_equal(shown, strip.pixels)


def may_be_repeated(
    strip: TexturedStrip, image: Pixels, parameters: ComparisonParameters | None = None
) -> bool:
    """Return whether an image may repeat another, as far as a strip of the other shows.

    It takes a small fraction of the time of `compare_images`, which decides when the answer is True.

    Parameters
    ----------
    strip
        Strip of the first image.
    image
        Gray levels of the second image, shape (H, W), 8 or 16 bits.
    parameters
        Parameters; the defaults by default.

    Returns
    -------
    bool
        False when the noise of the difference exceeds that of cameras, when it is so large beside the texture of the
        strip that far too few tiles count, or when more tiles of the strip have moved or changed than may have in a
        whole repeated image.

    Raises
    ------
    ImageError
        If the image is not a gray image of 8 or 16 bits.

    Notes
    -----
    A tile counts when the smaller eigenvalue of its gradients' covariance exceeds a limit in proportion to the squared
    noise. The mean square of the horizontal gradient is no smaller than that eigenvalue, and by Markov's inequality the
    fraction of tiles above the limit is at most the mean over the limit.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> scene = np.kron(rng.uniform(40, 200, (24, 24)), np.ones((8, 8)))
    >>> def exposure(shift: int) -> Pixels:
    ...     return np.rint(np.roll(scene, shift, 1) + rng.normal(0, 2, scene.shape)).astype(np.uint8)
    >>> strip = textured_strip(exposure(0))
    >>> may_be_repeated(strip, exposure(0))
    True
    >>> may_be_repeated(strip, exposure(1))
    False
    """
    p = parameters or ComparisonParameters()
    if strip.image_shape != image.shape:
        return False
    if may_be_equal(strip, image, p):
        return True
    rows, _ = _tiles(image.shape, p)
    a, b = scaled(strip.pixels, strip.white), scaled(_strip(image, strip.row, p), white_level(image))
    return not _row_differs(a, b, rows, p)


def _sampled_gradient(gray: Single, step: int) -> tuple[Single, Single]:
    """Return the gradient of an image in each step-th pixel of each step-th row, per px."""
    inner, half = slice(1, -1, step), np.float32(0.5)
    return (
        half * (gray[inner, 2::step] - gray[inner, :-2:step]),
        half * (gray[2::step, inner] - gray[:-2:step, inner]),
    )


def _covariances(gu: Single, gv: Single, mean: Callable[[Single], Float]) -> tuple[Float, Float, Float]:
    """Return the covariance of the gradients of each of K tiles, shape (K, 2, 2), and their means along u and v."""
    mu, mv = mean(gu), mean(gv)
    uv = mean(gu * gv) - mu * mv
    A = np.stack([mean(gu * gu) - mu * mu, uv, uv, mean(gv * gv) - mv * mv], -1).reshape(-1, 2, 2)
    return A, mu, mv


def _tiles(shape: tuple[int, ...], p: ComparisonParameters) -> tuple[int, int]:
    """Return the number of rows and columns of tiles of an image."""
    height, width = (size // _factor(shape, p) // p.tile_px for size in shape)
    return height, width


def _strip(image: Pixels, row: int, p: ComparisonParameters) -> Pixels:
    """Return a row of tiles of an image, reduced."""
    factor = _factor(image.shape, p)
    height = p.tile_px * factor
    return _reduced(image[row * height : (row + 1) * height], factor)


def _row_differs(a: Single, b: Single, rows: int, p: ComparisonParameters) -> bool:
    """Return whether a row of tiles shows that two images of ``rows`` rows differ."""
    valid = (a < p.saturated_gray) & (b < p.saturated_gray)
    chosen = valid[:: p.strip_sample_step, :: p.strip_sample_step]
    sampled = (image[:: p.strip_sample_step, :: p.strip_sample_step][chosen] for image in (a, b))
    gain, offset, noise = _fit_brightness(*sampled)
    if not math.isfinite(noise):
        return False
    if noise > p.max_noise_gray:
        return True
    a, b = gain * a, b - offset
    mean = float(np.square(a[:, 2:] - a[:, :-2]).mean()) / 4
    if (
        p.strip_margin * mean * (p.tile_px * p.max_displacement_sd_px) ** 2
        < p.min_counted_fraction * noise**2
    ):
        return True
    sparse = replace(p, min_counted_fraction=p.min_counted_fraction / p.strip_margin)
    changed, displacement = _compare_tiles(a, b, valid, noise, sparse)
    # without texture the whole image decides
    return len(displacement) > 0 and changed > p.max_changed_fraction * rows


def _factor(shape: tuple[int, ...], p: ComparisonParameters) -> int:
    """Return the factor by which an image is reduced."""
    return math.ceil(math.sqrt(math.prod(shape) / p.max_pixels))


def _reduced(image: Pixels, factor: int) -> Pixels:
    """Return the means of square blocks of an image (H, W), shape (H // factor, W // factor)."""
    if factor == 1:
        return image
    size = (max(image.shape[1] // factor, 1), max(image.shape[0] // factor, 1))
    return cast(Pixels, cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def _fit_brightness(a: Single, b: Single) -> tuple[np.float32, np.float32, float]:
    """Return the gain and offset from gray levels a to b, shape (N,), without outliers, and the noise of b - fit."""
    gain, offset, noise = np.float32(1), np.float32(0), float("inf")
    for _ in range(3):
        residual = np.abs(b - gain * a - offset)
        kept = residual <= 3 * MAD_TO_SD * np.median(residual) if len(a) else np.zeros(0, bool)
        x, y = a[kept], b[kept]
        if len(x) < 2 or np.ptp(x) == 0:
            break
        mean_x, mean_y = x.mean(), y.mean()
        gain = np.float32(((x - mean_x) * (y - mean_y)).mean() / np.square(x - mean_x).mean())
        offset = np.float32(mean_y - gain * mean_x)
        noise = float(np.sqrt(np.square(y - gain * x - offset).mean()))
    return gain, offset, noise


def _compare_tiles(
    a: Single, b: Single, valid: Bool, noise: float, p: ComparisonParameters
) -> tuple[float, Float]:
    """Return the fraction of tiles that moved or changed, and the displacements of those that count, px, shape (K,)."""
    rows, columns = (size // p.tile_px for size in a.shape)
    if rows * columns == 0:
        return 1.0, np.zeros(0)
    used = np.s_[: rows * p.tile_px, : columns * p.tile_px]
    weight = valid.astype(np.float32)
    n = np.maximum(_tile_sums(weight[used], rows, columns), 1)

    def mean(x: Single) -> Float:
        return _tile_sums(x[used], rows, columns) / n

    gu, gv = np.zeros_like(a), np.zeros_like(a)
    gu[:, 1:-1], gv[1:-1] = (a[:, 2:] - a[:, :-2]) / 2, (a[2:] - a[:-2]) / 2
    gu, gv = gu * weight, gv * weight
    A, mu, mv = _covariances(gu, gv, mean)
    counted = np.linalg.eigvalsh(A)[:, 0] * n.ravel() * p.max_displacement_sd_px**2 > noise**2
    if counted.mean() < p.min_counted_fraction:
        return 1.0, np.zeros(0)
    d = (b - a) * weight
    md = mean(d)
    r = np.stack([mean(gu * d) - mu * md, mean(gv * d) - mv * md], -1).reshape(-1, 2)
    shift = np.zeros_like(r)
    shift[counted] = np.linalg.solve(A[counted], r[counted, :, None])[..., 0]
    displacement = np.linalg.norm(shift, axis=1)
    variance = (mean(d * d) - md * md).ravel() - (r * shift).sum(axis=1)
    residual, gradient = np.sqrt(np.maximum(variance, 0)), np.sqrt(np.trace(A, axis1=1, axis2=2) / 2)
    changed = (residual > p.max_noise_ratio * noise) & (residual > p.max_gradient_ratio * gradient)
    return float((changed | (displacement > p.min_displacement_px)).mean()), displacement[counted]


def _tile_sums(image: Single, rows: int, columns: int) -> Float:
    """Return the sums over the tiles that divide an image (H, W), shape (rows, columns)."""
    height, width = image.shape
    narrow = np.add.reduceat(image, np.arange(columns) * width // columns, axis=1)
    return np.add.reduceat(narrow, np.arange(rows) * height // rows, axis=0).astype(np.float64)
