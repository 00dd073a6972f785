"""Template trees and sets: a root and its representatives in each property space (thesis section 4.3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import cv2
import numpy as np

from spinewatch.array_file import reading_arrays, write_arrays
from spinewatch.arrays import Bool, Floating
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.errors import SpinewatchError
from spinewatch.imaging.frame import SIDES, Side

HALF = 9
"""Half size of a stored template, px: 19 x 19 pixels, as in the thesis."""

_PARTS = ("roots", "representatives", "mask")


class TemplateError(SpinewatchError):
    """A template set cannot be built from the given samples or read from the given file."""

    code = "invalid-templates"


@dataclass(frozen=True, eq=False)
class TemplateTree:
    """Roots and representatives of one property space.

    Attributes
    ----------
    space
        Property space, with C planes.
    roots
        Shape (k, C, h, w): one root in a stored tree, one per ball size in a scaled one.
    representatives
        Shape (n, C, h, w).
    mask
        1 within a round mask, else 0, shape (h, w).
    """

    space: PropertySpace
    roots: Floating
    representatives: Floating
    mask: Floating

    def scaled(self, factors: Sequence[tuple[float, float]]) -> TemplateTree:
        """Return the tree for several sizes of balls.

        Parameters
        ----------
        factors
            Sizes relative to this tree's, each (horizontal, vertical).

        Returns
        -------
        TemplateTree
            Roots and representatives of all sizes, with the mask of the largest, without what is outside it.
        """
        largest = max(a for a, _ in factors), max(d for _, d in factors)
        h, w = (2 * max(1, round(HALF * f)) + 1 for f in reversed(largest))
        mask = (_resample(self.mask[None, None], largest, (h, w))[0, 0] > 0.5).astype(np.float32)
        inside = (..., _extent(mask.any(axis=1)), _extent(mask.any(axis=0)))
        return TemplateTree(
            self.space,
            np.concatenate([_resample(self.roots, f, (h, w)) for f in factors])[inside],
            np.concatenate([_resample(self.representatives, f, (h, w)) for f in factors])[inside],
            mask[inside],
        )


@dataclass(frozen=True, eq=False)
class TemplateSet:
    """Template trees of both sides in all property spaces.

    The lamp is between the cameras, so that its reflection is on the inner side of a ball: right of the centre in the
    left image, left of it in the right one. A tree common to both sides would shift all balls by a quarter of a pixel,
    with opposite signs in the two views, which is half a millimetre of depth.

    Attributes
    ----------
    version
        Name of the set, stored with results.
    diameter_px
        Width and height of the balls of the templates, px.
    trees
        Tree of each side and property space.
    """

    version: str
    diameter_px: tuple[float, float]
    trees: Mapping[tuple[Side, PropertySpace], TemplateTree]


def write_template_set(templates: TemplateSet) -> bytes:
    """Return a template set as the contents of a file.

    Parameters
    ----------
    templates
        The set.

    Returns
    -------
    bytes
        Contents of an npz file, read by `read_template_set`.
    """
    description = {"version": templates.version, "diameter_px": templates.diameter_px}
    arrays = {
        f"{side}_{space}_{part}": getattr(tree, part)
        for (side, space), tree in templates.trees.items()
        for part in _PARTS
    }
    return write_arrays(description, arrays)


def read_template_set(data: bytes) -> TemplateSet:
    """Return the template set of a file.

    Parameters
    ----------
    data
        Contents of a file written by `write_template_set` or ``spinewatch templates build``.

    Returns
    -------
    TemplateSet
        The set.

    Raises
    ------
    TemplateError
        When the file holds no template set.

    Examples
    --------
    >>> templates = default_template_set()
    >>> read_template_set(write_template_set(templates)).version == templates.version
    True
    """
    with reading_arrays(
        data, TemplateError("the file is not a template set; build one with `spinewatch templates build`")
    ) as (description, arrays):
        trees = {
            (side, space): TemplateTree(space, *(arrays[f"{side}_{space}_{part}"] for part in _PARTS))
            for side in SIDES
            for space in PropertySpace
        }
        width, height = description["diameter_px"]
        return TemplateSet(str(description["version"]), (float(width), float(height)), trees)


@cache
def default_template_set() -> TemplateSet:
    """Return the template set that ships with the library.

    Returns
    -------
    TemplateSet
        Made from samples/D1 by ``spinewatch templates build``; read once per process.
    """
    return read_template_set(resources.files(__package__).joinpath("templates.npz").read_bytes())


def _extent(used: Bool) -> slice:
    """Return the lines about the middle one of an odd number of lines, as far as any is used, at least three."""
    half = len(used) // 2
    reach = int(np.abs(np.flatnonzero(used) - half).max(initial=1))
    return slice(half - reach, half + reach + 1)


def _resample(planes: Floating, factor: tuple[float, float], size: tuple[int, int]) -> Floating:
    """Return planes (n, C, h', w') enlarged about their centre by (horizontal, vertical) factors; zero outside."""
    h, w = planes.shape[-2:]
    y, x = np.mgrid[: size[0], : size[1]]
    map_x = ((x - size[1] // 2) / factor[0] + w // 2).astype(np.float32)
    map_y = ((y - size[0] // 2) / factor[1] + h // 2).astype(np.float32)
    flat = [
        cv2.remap(p.astype(np.float32), map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        for p in planes.reshape(-1, h, w)
    ]
    return np.array(flat, dtype=np.float32).reshape(*planes.shape[:-2], *size)
