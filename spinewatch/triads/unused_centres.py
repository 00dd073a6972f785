"""Flags of ball centres that a person placed and that no triad uses.

Such a centre takes the place of a feature that was detected. If it is a few pixels off, no triad may be consistent with
it, and the ball then counts as hidden.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES
from spinewatch.triads.pose import MeasuredTriad

_SAME_PX = 1e-6
"""Distance below which an image of a ball is the feature itself, px."""


def unused_centre_flags(pair: tuple[Features, Features], triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    """Return a flag for each centre that a person placed and that no triad with a pose uses.

    Parameters
    ----------
    pair
        Features of the left and the right image.
    triads
        The triads.

    Returns
    -------
    tuple of Flag
        "centre-unused", with the place of the centre, px.

    Examples
    --------
    >>> nothing = Features.empty()
    >>> unused_centre_flags((nothing, nothing), [])
    ()
    """
    flags = []
    for view, (side, features) in enumerate(zip(SIDES, pair, strict=True)):
        images = [
            (ball.left_px, ball.right_px)[view]
            for triad in triads
            if triad.pose is not None
            for ball in triad.balls.values()
        ]
        used = np.array([image for image in images if image is not None]).reshape(-1, 2)
        for u, v in features.xy_px[features.is_manual]:
            if not (np.hypot(*(used - (u, v)).T) < _SAME_PX).any():
                detail = (
                    f"a person placed a centre at ({u:.1f}, {v:.1f}) px in the {side} image, and no triad uses it; its"
                    " ball may count as hidden. Compare the centre with the image"
                )
                flags.append(Flag("centre-unused", detail))
    return tuple(flags)
