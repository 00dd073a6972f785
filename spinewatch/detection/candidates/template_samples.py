"""Samples of balls, and the template trees and proximities that follow from them (thesis section 4.3.2)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from spinewatch.arrays import Floating
from spinewatch.detection.candidates.clusters import complete_link
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.templates import HALF, TemplateError, TemplateTree


def build_tree(space: PropertySpace, samples: Floating, mask: Floating, n_classes: int) -> TemplateTree:
    """Return the template tree of samples.

    Parameters
    ----------
    space
        Property space of the samples.
    samples
        Samples, shape (m, C, 19, 19).
    mask
        1 at the pixels that count, else 0, shape (19, 19).
    n_classes
        Number of classes.

    Returns
    -------
    TemplateTree
        The means of complete-link classes of the normalized samples as representatives, their mean as root.

    Raises
    ------
    TemplateError
        With fewer samples than classes, or for a sample without contrast.

    References
    ----------
    Thesis section 4.3.2, where samples are sorted by eye into six gray and four edge classes.
    """
    if len(samples) < n_classes:
        raise TemplateError(
            f"{n_classes} template classes need at least as many samples, not {len(samples)}; annotate more balls"
        )
    unit = normalize_samples(space, samples, mask)
    labels = complete_link(sample_distances(unit), n_classes)
    representatives = np.stack([unit[labels == label].mean(axis=0) for label in np.unique(labels)])
    return TemplateTree(
        space,
        representatives.mean(axis=0, keepdims=True).astype(np.float32),
        representatives.astype(np.float32),
        mask.astype(np.float32),
    )


def normalize_samples(space: PropertySpace, samples: Floating, mask: Floating) -> Floating:
    """Return samples of norm 1, so that bright and dark balls have equal weight.

    Parameters
    ----------
    space
        Property space of the samples; gray levels and edges lose their mean, gradient vectors do not.
    samples
        Samples, shape (m, C, h, w).
    mask
        1 at the pixels that count, else 0, shape (h, w).

    Returns
    -------
    Floating
        Normalized samples, shape (m, C, h, w), zero outside the mask.

    Raises
    ------
    TemplateError
        For a sample without contrast.
    """
    inside = samples[..., mask > 0]
    if space is not PropertySpace.DIRECTIVITY:
        inside = inside - inside.mean(axis=-1, keepdims=True)
    norm = np.linalg.norm(inside.reshape(len(samples), -1), axis=1)
    if not np.all(norm > 0):
        raise TemplateError("a sample is a flat patch; leave it out of the annotation")
    unit = np.zeros_like(samples)
    unit[..., mask > 0] = inside / norm[:, None, None]
    return unit


def sample_distances(unit: Floating) -> Floating:
    """Return the distances of normalized samples from each other.

    Parameters
    ----------
    unit
        Normalized samples, shape (m, C, h, w).

    Returns
    -------
    Floating
        One minus the correlation coefficient, shape (m, m).
    """
    distance = np.clip(1 - proximity_matrix(unit), 0, None)
    np.fill_diagonal(distance, 0)
    return distance


def proximity_matrix(templates: Floating) -> Floating:
    """Return the similarities of templates with each other.

    Parameters
    ----------
    templates
        Masked templates, shape (n, C, h, w).

    Returns
    -------
    Floating
        Normalized cross-correlations, shape (n, n).

    References
    ----------
    Thesis Tables 4.2 and 4.3.

    Examples
    --------
    >>> proximity_matrix(np.array([[[[1.0, 0.0]]], [[[3.0, 4.0]]]])).round(3)
    array([[1. , 0.6],
           [0.6, 1. ]])
    """
    flat = templates.reshape(len(templates), -1)
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    return np.asarray(flat @ flat.T)


def tree_proximities(tree: TemplateTree) -> Floating:
    """Return the proximity matrix of a template tree.

    Parameters
    ----------
    tree
        Tree with n representatives.

    Returns
    -------
    Floating
        Proximities, shape (n + 1, n + 1), of the mean of the representatives, which is the root of the thesis, and of
        the representatives. The tree's own root may be whitened and then no longer resembles its samples.
    """
    root = tree.representatives.mean(axis=0, keepdims=True)
    return proximity_matrix(np.concatenate([root, tree.representatives]))


def round_mask(diameter_px: tuple[float, float], margin: float) -> Floating:
    """Return the mask of a template.

    Parameters
    ----------
    diameter_px
        Width and height of a ball, px.
    margin
        Radius of the mask in ball radii.

    Returns
    -------
    Floating
        1 inside, else 0, shape (19, 19): a circle on the plate, an ellipse in pixels.

    Examples
    --------
    >>> int(round_mask((3.0, 3.0), 1.0).sum())
    9
    """
    y, x = np.mgrid[-HALF : HALF + 1, -HALF : HALF + 1]
    a, b = (0.5 * margin * d for d in diameter_px)
    return np.asarray((x / a) ** 2 + (y / b) ** 2 <= 1, dtype=np.float32)


def cut_samples(
    planes: Floating, centres_px: Sequence[tuple[float, float]], scale: tuple[float, float]
) -> Floating:
    """Return samples of an image at the size of stored templates.

    Parameters
    ----------
    planes
        Image, shape (C, H, W).
    centres_px
        Centres (u, v) of m balls, px.
    scale
        Size of the balls in stored templates over that in the image, (horizontal, vertical).

    Returns
    -------
    Floating
        Samples, shape (m, C, 19, 19), interpolated linearly.
    """
    across, down = 1 / scale[0], 1 / scale[1]
    y, x = np.mgrid[-HALF : HALF + 1, -HALF : HALF + 1].astype(np.float32)
    patches = [
        [
            cv2.remap(
                np.ascontiguousarray(plane),
                (x * across + u).astype(np.float32),
                (y * down + v).astype(np.float32),
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REFLECT_101,
            )
            for plane in planes
        ]
        for u, v in centres_px
    ]
    return np.array(patches, dtype=np.float32).reshape(-1, len(planes), 2 * HALF + 1, 2 * HALF + 1)
