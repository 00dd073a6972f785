"""What a network sees of each example: its patch, and the mean patch of the other balls of its image.

Which of these balls are known is drawn again for every epoch: at first the detector knows none, and then those of high
odds, of which a few may be something else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from spinewatch.arrays import Bool
from spinewatch.detection.refinement.networks import BallNetwork
from spinewatch.detection.refinement.other_balls import MIN_VISIBLE, PatchSums
from spinewatch.simulation.images.examples import Examples
from training.augmentation import as_tensors
from training.model import Architecture

UNKNOWN_SHARE = 0.2
"""Fraction of the images of which no ball is known."""
MIN_KNOWN_SHARE = 0.3
"""Least share of the balls of another image that are known."""
FALSE_SHARE = 0.03
"""Fraction of the examples without a ball that are taken for one."""


@dataclass(frozen=True, eq=False)
class SeenExamples:
    """Examples as a network sees them, some of the balls known.

    Attributes
    ----------
    patches
        Normalized patches, shape (n, size, size).
    truth
        Their truth, shape (n, 8).
    examples
        The examples.
    is_known
        Which examples are known as balls, or taken for one, shape (n,).
    sums
        Sums of the patches of these, per image; None for a network that sees no others.
    """

    patches: Tensor
    truth: Tensor
    examples: Examples
    is_known: Bool
    sums: PatchSums | None

    @classmethod
    def of(cls, examples: Examples, network: Architecture | BallNetwork) -> SeenExamples:
        """Return examples whose balls in view are all known.

        Parameters
        ----------
        examples
            n examples.
        network
            What is fitted to them.

        Returns
        -------
        SeenExamples
            What the network sees of them.
        """
        patches, truth = as_tensors(examples)
        empty = np.zeros(len(patches), dtype=bool)
        seen = cls(patches, truth, examples, empty, None)
        return seen._knowing(_in_view(examples)) if network.sees_others else seen

    def some_known(self, rng: np.random.Generator) -> SeenExamples:
        """Return the same examples with a random choice of known balls.

        Parameters
        ----------
        rng
            Source of random numbers.

        Returns
        -------
        SeenExamples
            What the network sees of them.
        """
        if self.sums is None:
            return self
        image = self.examples.image
        share = rng.uniform(MIN_KNOWN_SHARE, 1, image.max() + 1)
        share *= rng.random(len(share)) > UNKNOWN_SHARE
        taken = np.where(self.examples.ball, _in_view(self.examples), rng.random(len(image)) < FALSE_SHARE)
        return self._knowing(taken & (rng.random(len(image)) < share[image]))

    def images(self, batch: Tensor) -> Tensor:
        """Return what the network sees of a batch.

        Parameters
        ----------
        batch
            Indices of its examples, shape (n,).

        Returns
        -------
        Tensor
            Images of each patch, shape (n, channels in, size, size).
        """
        patches = self.patches[batch]
        if self.sums is None:
            return patches[:, None]
        index = batch.numpy()
        others = self.sums.mean_of_others(patches.numpy(), self.is_known[index], self.examples.image[index])
        return torch.stack([patches, torch.from_numpy(others)], dim=1)

    def _knowing(self, is_known: Bool) -> SeenExamples:
        sums = PatchSums.per_image(self.patches.numpy(), is_known, self.examples.image)
        return SeenExamples(self.patches, self.truth, self.examples, is_known, sums)


def _in_view(examples: Examples) -> Bool:
    return np.asarray(examples.ball & (examples.visible > MIN_VISIBLE))
