"""The mean patch of the other balls of an image, which the networks see beside each patch.

All balls of an image have the same paint, light, blur and noise, while each has its own surroundings. Where the outline
of a ball is faint, its mean in the others shows where it is to be expected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Int, Single

MIN_OTHERS = 3
"""Least number of other balls; with fewer the mean counts as unknown, and all of it is 0."""
MIN_VISIBLE = 0.5
"""Least visible fraction of a ball that contributes."""


@dataclass(frozen=True, eq=False)
class PatchSums:
    """Sums of the patches of balls, per image.

    Attributes
    ----------
    total
        Sums, shape (m, size, size).
    count
        Number of patches of each, shape (m,).
    """

    total: Single
    count: Int

    @classmethod
    def per_image(cls, patches: Single, is_ball: Bool, image: Int) -> PatchSums:
        """Return the sums of the patches of each image.

        Parameters
        ----------
        patches
            Normalized patches, shape (n, size, size).
        is_ball
            Which of them contribute, shape (n,).
        image
            Number of the image of each, shape (n,); those of an image follow one another.

        Returns
        -------
        PatchSums
            The sums of m images, up to the one of the greatest number.
        """
        m = int(image.max(initial=-1)) + 1
        total, count = np.zeros((m, *patches.shape[1:]), np.float32), np.zeros(m, np.intp)
        members = np.flatnonzero(is_ball)
        if members.size:
            of_image = image[members]
            first = np.flatnonzero(np.diff(of_image, prepend=-1))
            total[of_image[first]] = np.add.reduceat(patches[members], first, axis=0)
            count += np.bincount(of_image, minlength=m)
        return cls(total, count)

    def mean_of_others(self, patches: Single, is_ball: Bool, image: Int) -> Single:
        """Return the mean patch of the other balls of the image of each patch.

        Parameters
        ----------
        patches, is_ball, image
            Some of the patches that the sums are of.

        Returns
        -------
        Single
            Means, shape (n, size, size); 0 where too few others are known.
        """
        count = self.count[image] - is_ball
        mean = self.total[image] - patches * is_ball[:, None, None].astype(np.float32)
        mean *= np.where(count >= MIN_OTHERS, 1 / count.clip(1), 0).astype(np.float32)[:, None, None]
        return np.asarray(mean)


def mean_of_other_balls(patches: Single, is_ball: Bool) -> Single:
    """Return the mean patch of the other balls of one image, for each of its patches.

    Parameters
    ----------
    patches
        Normalized patches of an image, shape (n, size, size).
    is_ball
        Which of them show balls, as far as that is known, shape (n,).

    Returns
    -------
    Single
        Means, shape (n, size, size); 0 where fewer than `MIN_OTHERS` others are known.

    Examples
    --------
    >>> patches = np.arange(5, dtype=np.float32)[:, None, None]
    >>> mean_of_other_balls(patches, np.array([True, True, True, True, False])).ravel().round(2)
    array([2.  , 1.67, 1.33, 1.  , 1.5 ], dtype=float32)
    """
    image = np.zeros(len(patches), np.intp)
    return PatchSums.per_image(patches, is_ball, image).mean_of_others(patches, is_ball, image)
