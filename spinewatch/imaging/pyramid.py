"""Images at a lower resolution."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Single


def reduce_image(gray: Single, factor: int) -> Single:
    """Return an image at a lower resolution: the means of square blocks.

    Parameters
    ----------
    gray
        Gray levels, shape (H, W).
    factor
        Side of a block, px. The centre of block (i, j) is the pixel ``factor * (i, j) + (factor - 1) / 2``.

    Returns
    -------
    Single
        Means, shape (H // factor, W // factor), without the rows and columns at the far edges that fill no block; the
        image itself for a factor of 1.

    Examples
    --------
    >>> reduce_image(np.arange(12, dtype=np.float32).reshape(3, 4), 2)
    array([[2.5, 4.5]], dtype=float32)
    """
    if factor == 1:
        return gray
    h, w = (n // factor for n in gray.shape)
    blocks = gray[: h * factor, : w * factor].reshape(h, factor, w, factor)
    return np.asarray(blocks.mean(axis=(1, 3)), dtype=np.float32)
