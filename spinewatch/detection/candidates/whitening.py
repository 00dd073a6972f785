"""Whitening of gradient templates: the matched filter against the clutter of wounds and drapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Float, Floating, Single


@dataclass(frozen=True)
class WhiteningParameters:
    """Parameters of the clutter model.

    Attributes
    ----------
    ridge
        Variance of uncorrelated clutter as a multiple of the mean variance of correlated clutter.
    window_px
        Side of the window in which the local strength of gradients is measured, px; a little larger than a template.
    strength_floor
        Fraction of the median strength that is added to the local strength.
    """

    ridge: float = 3.0
    window_px: int = 15
    strength_floor: float = 0.3


def clutter_covariance(
    gradients: Sequence[Single], mask: Floating, parameters: WhiteningParameters
) -> Floating:
    """Return the covariance of the gradient vectors within a mask placed at random on images.

    Gradients are divided by their local strength, because normalized similarity does not depend on it. The covariance
    of two pixels is then the autocorrelation at their distance.

    Parameters
    ----------
    gradients
        Gradients of log images, each of shape (2, H, W).
    mask
        1 at the p pixels that count, else 0, shape (h, w).
    parameters
        Measure of the local strength.

    Returns
    -------
    Floating
        Covariance, shape (2 p, 2 p): u components, then v components.
    """
    reach = max(mask.shape) - 1
    table = np.mean([_autocorrelation(_even_strength(g, parameters), reach) for g in gradients], axis=0)
    y, x = np.nonzero(mask)
    lags = table[:, :, y[:, None] - y + reach, x[:, None] - x + reach]
    size = 2 * len(y)
    return np.asarray(lags.transpose(0, 2, 1, 3).reshape(size, size))


def whiten(roots: Floating, mask: Floating, clutter: Floating, ridge: float) -> Floating:
    """Return templates as matched filters against clutter.

    Parameters
    ----------
    roots
        Templates, shape (n, C, h, w).
    mask
        1 at the p pixels that count, else 0, shape (h, w).
    clutter
        Covariance of clutter within the mask, shape (C p, C p).
    ridge
        Variance of uncorrelated clutter as a multiple of the mean variance of correlated clutter.

    Returns
    -------
    Floating
        ``(clutter + ridge I)^-1 root`` of norm 1, shape (n, C, h, w).

    Examples
    --------
    >>> root = np.array([[[[1.0, 1.0]]]])
    >>> whiten(root, np.ones((1, 2)), np.diag([1.0, 3.0]), ridge=0.0).round(3)
    array([[[[0.949, 0.316]]]])
    """
    inside = mask > 0
    flat = roots[:, :, inside].reshape(len(roots), -1).astype(np.float64)
    noise = ridge * np.trace(clutter) / len(clutter)
    filters = np.linalg.solve((clutter + clutter.T) / 2 + noise * np.eye(len(clutter)), flat.T).T
    white = np.zeros_like(roots)
    white[:, :, inside] = (filters / np.linalg.norm(filters, axis=1, keepdims=True)).reshape(
        *roots.shape[:2], -1
    )
    return white


def _even_strength(gradient: Single, p: WhiteningParameters) -> Float:
    """Return gradients (2, H, W) over their local strength."""
    size = (p.window_px, p.window_px)
    power = cv2.boxFilter((gradient.astype(np.float64) ** 2).sum(axis=0), -1, size)
    strength = np.sqrt(np.maximum(power, 0))
    return np.asarray(gradient / (strength + p.strength_floor * np.median(strength)))


def _autocorrelation(planes: Float, reach: int) -> Float:
    """Return the mean products (C, C, 2 reach + 1, 2 reach + 1) of planes (C, H, W) with themselves, by lag."""
    h, w = planes.shape[1:]
    size = (h + reach, w + reach)
    spectrum = np.fft.rfft2(planes, s=size)
    product = spectrum[:, None] * spectrum.conj()[None]
    lags = np.roll(np.fft.irfft2(product, s=size), (reach, reach), axis=(2, 3)) / (h * w)
    return np.asarray(lags[:, :, : 2 * reach + 1, : 2 * reach + 1])
