"""Training examples: patches of simulated images, of a ball or of something else, with the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Int, Single
from spinewatch.simulation.images.families import FAMILIES
from spinewatch.simulation.images.shots import (
    N_TRUTH,
    ExampleParameters,
    exposed,
    random_shot,
    random_view,
)
from spinewatch.simulation.images.textures import random_textures

_WORLDS = 8
"""Worlds of each view."""
_EXPOSURES = 2
"""Exposures of each view, by different sensors."""
_TEXTURES = 40
_TEXTURE_SIZE = 256
_TEXTURE_LIFE = 60
"""Number of views after which the textures are replaced."""


@dataclass(frozen=True, eq=False)
class Examples:
    """n examples.

    Attributes
    ----------
    patches
        Log gray levels as `cut_patches` samples them, shape (n, size, size).
    ball
        Whether there is a ball near the middle, shape (n,).
    offset
        Position of the ball's centre relative to the middle, u and v, shape (n, 2), in radii.
    visible
        Visible fraction of the ball, shape (n,).
    log_size
        Logarithm of the ratio of true to assumed size, shape (n,).
    up
        Expected direction of the cart's lamp: u and v components of a unit vector, shape (n, 2).
    lamp
        True direction of the cart's lamp or of the middle of its lamps, shape (n, 2).
    log_height
        Logarithm of the height, in radii, of the ball's centre over the tissue, shape (n,).
    families
        Whether an example belongs to each of the `FAMILIES`, shape (n, k).
    image
        Number of the image that an example is of, shape (n,): examples of one image share light, sensor and materials,
        and follow one another.
    """

    patches: NDArray[np.float16]
    ball: Bool
    offset: Single
    visible: Single
    log_size: Single
    up: Single
    lamp: Single
    log_height: Single
    families: Bool
    image: Int

    @classmethod
    def concatenate(cls, parts: Sequence[Examples]) -> Examples:
        """Return the examples of several parts, in order.

        Parameters
        ----------
        parts
            The parts, at least one, of different images.

        Returns
        -------
        examples : Examples
            All examples, their images numbered from 0 on.
        """
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
        counts = [part.image.max(initial=-1) + 1 for part in parts]
        before = np.cumsum([0, *counts[:-1]])
        joined["image"] += np.repeat(before, [len(part.image) for part in parts])
        return cls(**joined)

    def take(self, index: Int | Bool) -> Examples:
        """Return a selection of the examples.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        examples : Examples
            The selected examples, in the order of the index.
        """
        return Examples(*(values[index] for values in vars(self).values()))

    def without(self, families: Sequence[str]) -> Examples:
        """Return the examples that belong to none of some families of looks.

        Parameters
        ----------
        families
            Names of families.

        Returns
        -------
        examples : Examples
            The other examples.
        """
        belongs = self.families[:, [FAMILIES.index(name) for name in families]]
        return self.take(np.flatnonzero(~belongs.any(axis=1)))


def random_examples(rng: np.random.Generator, count: int, parameters: ExampleParameters) -> Examples:
    """Return examples of random worlds.

    Parameters
    ----------
    rng
        Source of random numbers.
    count
        Number of examples.
    parameters
        Their properties.

    Returns
    -------
    examples : Examples
        The examples; the same state of ``rng`` gives the same examples.

    Examples
    --------
    >>> from spinewatch.detection.refinement.patches import PatchGrid
    >>> parameters = ExampleParameters(PatchGrid(25, 5.0), (8.0, 12.0), wider=20.0)
    >>> random_examples(np.random.default_rng(0), 2, parameters).patches.shape
    (2, 25, 25)
    """
    size = parameters.grid.size
    patches = np.empty((count, size, size), np.float16)
    truth = np.empty((count, N_TRUTH), np.float32)
    image = np.arange(count) // _WORLDS
    for i in range(count):
        view_number, of_view = divmod(i, _WORLDS * _EXPOSURES)
        exposure, world = divmod(of_view, _WORLDS)
        if of_view == 0:
            if view_number % _TEXTURE_LIFE == 0:
                textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
            view = random_view(rng, textures, _EXPOSURES, parameters)
            shots = [random_shot(rng, textures, view, parameters) for _ in range(_WORLDS)]
        patches[i], truth[i] = exposed(rng, shots[world], view.sensors[exposure], parameters.grid)
    ball, offset, visible, log_size, up, lamp, log_height, families = np.split(
        truth, [1, 3, 4, 5, 7, 9, 10], axis=1
    )
    return Examples(
        patches,
        ball[:, 0] > 0,
        offset,
        visible[:, 0],
        log_size[:, 0],
        up,
        lamp,
        log_height[:, 0],
        families > 0,
        image,
    )
