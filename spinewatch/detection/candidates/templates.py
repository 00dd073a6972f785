"""Template trees: a root and its representatives in a property space (thesis section 4.3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal, get_args

import cv2
import numpy as np

from spinewatch.array_file import reading_arrays, write_arrays
from spinewatch.arrays import Floating
from spinewatch.detection.candidates.clusters import complete_link
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.errors import SpinewatchError

HALF = 9
"""Half size of a stored template: 19 x 19 pixels, as in the thesis."""


class TemplateError(SpinewatchError):
    """A template set cannot be built from the given samples or read from the given file."""

    code = "invalid-templates"


_PARTS = ("roots", "representatives", "mask")


@dataclass(frozen=True, eq=False)
class TemplateTree:
    """Roots (k, C, h, w) over representatives (n, C, h, w) of one property space, with a round mask (h, w).

    A stored tree has one root; a tree for several ball sizes has one root a size.
    """

    space: PropertySpace
    roots: Floating
    representatives: Floating
    mask: Floating

    def scaled(self, factors: Sequence[tuple[float, float]]) -> TemplateTree:
        """Return a tree for balls larger by each of the factors (across, down); all share the largest one's mask."""
        largest = max(a for a, _ in factors), max(d for _, d in factors)
        h, w = (2 * max(1, round(HALF * f)) + 1 for f in reversed(largest))
        return TemplateTree(
            self.space,
            np.concatenate([_resample(self.roots, f, (h, w)) for f in factors]),
            np.concatenate([_resample(self.representatives, f, (h, w)) for f in factors]),
            (_resample(self.mask[None, None], largest, (h, w))[0, 0] > 0.5).astype(np.float32),
        )


Side = Literal["left", "right"]


@dataclass(frozen=True, eq=False)
class TemplateSet:
    """Trees of each side's property spaces, made from balls of ``diameter_px`` (width, height).

    The lamp hangs between the cameras, so that its reflection sits on the inner side of a ball: right of the
    centre in the left image, left of it in the right one. One tree for both would place every ball a quarter
    of a pixel wrong, with opposite signs in the two views, which is half a millimetre of depth.
    """

    version: str
    diameter_px: tuple[float, float]
    trees: Mapping[tuple[Side, PropertySpace], TemplateTree]


def build_tree(space: PropertySpace, samples: Floating, mask: Floating, clusters: int) -> TemplateTree:
    """Return the tree of samples (m, C, 19, 19): complete-link classes on 1 - rho, their means, and the means' mean.

    The thesis sorted its samples by eye into six gray and four edge classes. Raises ``TemplateError`` with fewer
    samples than clusters.
    """
    if len(samples) < clusters:
        raise TemplateError(f"{clusters} template classes need at least as many samples, not {len(samples)}")
    unit = normalise_samples(space, samples, mask)
    of = complete_link(sample_distances(unit), clusters)
    representatives = np.stack([unit[of == label].mean(axis=0) for label in np.unique(of)])
    return TemplateTree(
        space,
        representatives.mean(axis=0, keepdims=True).astype(np.float32),
        representatives.astype(np.float32),
        mask.astype(np.float32),
    )


def normalise_samples(space: PropertySpace, samples: Floating, mask: Floating) -> Floating:
    """Return samples (m, C, 19, 19) of norm 1, zero outside the mask: a well-lit ball must not outvote a dark one.

    Gray levels and edges lose their mean, gradient vectors do not. Raises ``TemplateError`` for a flat sample.
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
    """Return 1 - rho (m, m) of normalised samples with each other."""
    distance = np.clip(1 - proximity_matrix(unit), 0, None)
    np.fill_diagonal(distance, 0)
    return distance


def proximity_matrix(templates: Floating) -> Floating:
    """Return the (n, n) similarities of masked templates (n, C, h, w) with each other (Tables 4.2 and 4.3)."""
    flat = templates.reshape(len(templates), -1)
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    return np.asarray(flat @ flat.T)


def tree_proximities(tree: TemplateTree) -> Floating:
    """Return the proximity matrix (n + 1, n + 1) of a tree: first the mean of its representatives, then these.

    That mean is the root as the thesis has it; a root that was whitened later no longer looks like its samples.
    """
    root = tree.representatives.mean(axis=0, keepdims=True)
    return proximity_matrix(np.concatenate([root, tree.representatives]))


def round_mask(diameter_px: tuple[float, float], margin: float) -> Floating:
    """Return a (19, 19) mask of 1 within ``margin`` ball radii of the centre, round on the plate, oval in pixels."""
    y, x = np.mgrid[-HALF : HALF + 1, -HALF : HALF + 1]
    a, b = (0.5 * margin * d for d in diameter_px)
    return np.asarray((x / a) ** 2 + (y / b) ** 2 <= 1, dtype=np.float32)


def cut_samples(
    planes: Floating, centres_px: Sequence[tuple[float, float]], scale: tuple[float, float]
) -> Floating:
    """Return patches (m, C, 19, 19) about sub-pixel centres, shrunk by ``scale`` = reference size over actual size."""
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


def write_template_set(templates: TemplateSet) -> bytes:
    """Return the bytes of a template set file."""
    about = {"version": templates.version, "diameter_px": templates.diameter_px}
    arrays = {
        f"{side}_{space}_{part}": getattr(tree, part)
        for (side, space), tree in templates.trees.items()
        for part in _PARTS
    }
    return write_arrays(about, arrays)


def read_template_set(data: bytes) -> TemplateSet:
    """Return the template set of a file's bytes; raise ``TemplateError`` when it is none."""
    with reading_arrays(
        data, TemplateError("the file is not a template set; build one with `spinewatch templates build`")
    ) as (about, arrays):
        trees = {
            (side, space): TemplateTree(space, *(arrays[f"{side}_{space}_{part}"] for part in _PARTS))
            for side in get_args(Side)
            for space in PropertySpace
        }
        width, height = about["diameter_px"]
        return TemplateSet(str(about["version"]), (float(width), float(height)), trees)


@cache
def default_template_set() -> TemplateSet:
    """Return the set that ships with the library, made from samples/D1 by ``spinewatch templates build``."""
    return read_template_set(resources.files(__package__).joinpath("templates.npz").read_bytes())


def _resample(planes: Floating, factor: tuple[float, float], size: tuple[int, int]) -> Floating:
    """Return planes (n, C, h', w') enlarged by ``factor`` (across, down) about their centre; zero beyond the edge."""
    h, w = planes.shape[-2:]
    y, x = np.mgrid[: size[0], : size[1]]
    map_x = ((x - size[1] // 2) / factor[0] + w // 2).astype(np.float32)
    map_y = ((y - size[0] // 2) / factor[1] + h // 2).astype(np.float32)
    flat = [
        cv2.remap(p.astype(np.float32), map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        for p in planes.reshape(-1, h, w)
    ]
    return np.array(flat, dtype=np.float32).reshape(*planes.shape[:-2], *size)
