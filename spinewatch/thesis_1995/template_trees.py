"""Template trees of DETECT-POINT: averages of samples in six gray and four edge classes (thesis section 4.3.2)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib import resources

import numpy as np

from spinewatch.array_file import reading_arrays, write_arrays
from spinewatch.arrays import Floating
from spinewatch.detection.candidates.clusters import complete_link
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.template_building import REFERENCE_PX, AnnotatedView
from spinewatch.detection.candidates.template_samples import (
    cut_samples,
    normalize_samples,
    round_mask,
    sample_distances,
)
from spinewatch.detection.candidates.templates import TemplateError, TemplateTree
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters, preprocess

_SPACES = (PropertySpace.GRAY, PropertySpace.EDGE)
_PARTS = ("roots", "representatives", "mask")


@dataclass(frozen=True)
class TreeParameters:
    """Parameters of `build_trees`.

    Attributes
    ----------
    gray_classes, edge_classes
        Number of classes of each property space.
    mask_radii
        Radius of the mask in ball radii: the ball and a thin ring about it.
    """

    gray_classes: int = 6
    edge_classes: int = 4
    mask_radii: float = 1.38


@dataclass(frozen=True, eq=False)
class PublishedTrees:
    """The template trees of DETECT-POINT; the same for both views.

    Attributes
    ----------
    diameter_px
        Width and height of the balls of the templates, px.
    trees
        Tree of gray levels and of edges.
    """

    diameter_px: tuple[float, float]
    trees: Mapping[PropertySpace, TemplateTree]

    @property
    def version(self) -> str:
        """Name of the trees that is stored with results: the method, and a digest of their templates."""
        digest = sha256()
        for space in _SPACES:
            for part in _PARTS:
                digest.update(np.ascontiguousarray(getattr(self.trees[space], part)).tobytes())
        return f"thesis-1995-{digest.hexdigest()[:8]}"

    def scaled(self, ball_px: tuple[float, float]) -> PublishedTrees:
        """Return the trees for balls of another size.

        Parameters
        ----------
        ball_px
            Width and height of a ball, px.

        Returns
        -------
        PublishedTrees
            The trees, resampled.
        """
        factor = (ball_px[0] / self.diameter_px[0], ball_px[1] / self.diameter_px[1])
        return PublishedTrees(ball_px, {space: tree.scaled([factor]) for space, tree in self.trees.items()})


def build_trees(views: Iterable[AnnotatedView], parameters: TreeParameters) -> PublishedTrees:
    """Return the template trees of annotated images.

    A representative is the average of the samples of a class, and the root that of the representatives.

    Parameters
    ----------
    views
        Images of either side with their balls.
    parameters
        Numbers of classes and mask.

    Returns
    -------
    PublishedTrees
        The trees.

    Raises
    ------
    TemplateError
        When there are fewer balls than classes, or a sample has no contrast.

    References
    ----------
    Thesis section 4.3.2. The thesis sorted the samples into classes by eye; here complete link on correlation
    coefficients does, which the thesis names as the method of its source.
    """
    samples: dict[PropertySpace, list[Floating]] = {space: [] for space in _SPACES}
    for view in views:
        image = preprocess(view.frame.gray(), PreprocessingParameters(statistic=None))
        planes = {PropertySpace.GRAY: image.gray, PropertySpace.EDGE: image.edges}
        for centre, (width, height) in zip(view.centres_px, view.balls_px, strict=True):
            scale = (REFERENCE_PX[0] / width, REFERENCE_PX[1] / height)
            for space in _SPACES:
                samples[space].append(cut_samples(planes[space][None], [tuple(centre)], scale))
    mask = round_mask(REFERENCE_PX, parameters.mask_radii)
    counts = {PropertySpace.GRAY: parameters.gray_classes, PropertySpace.EDGE: parameters.edge_classes}
    return PublishedTrees(
        REFERENCE_PX, {space: _tree(space, samples[space], mask, counts[space]) for space in _SPACES}
    )


def write_trees(trees: PublishedTrees) -> bytes:
    """Return template trees as the contents of a file.

    Parameters
    ----------
    trees
        The trees.

    Returns
    -------
    bytes
        Contents of an npz file, read by `read_trees`.
    """
    arrays = {
        f"{space}_{part}": getattr(tree, part) for space, tree in trees.trees.items() for part in _PARTS
    }
    return write_arrays({"diameter_px": trees.diameter_px}, arrays)


def read_trees(data: bytes) -> PublishedTrees:
    """Return the template trees of a file.

    Parameters
    ----------
    data
        Contents of a file written by `write_trees`.

    Returns
    -------
    PublishedTrees
        The trees.

    Raises
    ------
    TemplateError
        When the file holds no such trees.
    """
    problem = TemplateError(
        "the file has no template trees of 1995; build them with `spinewatch templates build-1995`"
    )
    with reading_arrays(data, problem) as (description, arrays):
        width, height = description["diameter_px"]
        trees = {
            space: TemplateTree(space, *(arrays[f"{space}_{part}"] for part in _PARTS)) for space in _SPACES
        }
        return PublishedTrees((float(width), float(height)), trees)


@cache
def default_trees() -> PublishedTrees:
    """Return the template trees that ship with the library.

    Returns
    -------
    PublishedTrees
        Made from stage PRE of samples/D1, as the thesis made its own from its stage PRE; read once per process.
    """
    return read_trees(resources.files(__package__).joinpath("templates.npz").read_bytes())


def _tree(space: PropertySpace, samples: list[Floating], mask: Floating, n_classes: int) -> TemplateTree:
    if len(samples) < n_classes:
        raise TemplateError(
            f"{n_classes} template classes need at least as many samples, not {len(samples)}; annotate more balls"
        )
    patches = np.concatenate(samples)
    labels = complete_link(sample_distances(normalize_samples(space, patches, mask)), n_classes)
    representatives = np.stack([patches[labels == label].mean(axis=0) for label in np.unique(labels)])
    return TemplateTree(
        space,
        representatives.mean(axis=0, keepdims=True).astype(np.float32),
        representatives.astype(np.float32),
        mask.astype(np.float32),
    )
