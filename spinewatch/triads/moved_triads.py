"""Triads that edits of ball centres have moved, although they were found in full view before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES, Side
from spinewatch.triads.pose import MeasuredTriad, Pose

MAX_MOVE_SD = 5.0
"""Greatest distance of two poses of a triad, in standard deviations of both: 1 in 65,000. None of 201 edits of rendered
pairs that place centres on the balls exceeds it (``python -m bench.placed_centres``)."""

_SAME_PX = 1e-6
"""Distance below which two images of a ball are the same feature, px."""

_MIN_SHARED = 2
"""Number of images of balls that the same triad has before and after edits."""


@dataclass(frozen=True, eq=False)
class EarlierTriad:
    """A triad of the take before the edits, all of whose balls were detected in both images.

    Attributes
    ----------
    pose
        Its pose.
    images_px
        Images (u, v) of its n balls by image, shape (n, 2), px.
    """

    pose: Pose
    images_px: Mapping[Side, Float]


def moved_triad_flags(before: Sequence[EarlierTriad], after: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    """Return a flag for each triad with a placed centre that is far from where it was before the edits.

    Parameters
    ----------
    before
        Triads of the take before, in full view and without a placed centre.
    after
        Triads after the edits, in order along the spine.

    Returns
    -------
    tuple of Flag
        "triad-moved-by-edit", with the distance, mm and standard deviations of both poses.
    """
    flags = []
    for number, triad in enumerate(after, start=1):
        if triad.pose is None or not any(ball.manual_in for ball in triad.balls.values()):
            continue
        earlier = next((one for one in before if _shared(one, triad) >= _MIN_SHARED), None)
        if earlier is None:
            continue
        d = triad.pose.position_mm - earlier.pose.position_mm
        S = triad.pose.covariance[:3, :3] + earlier.pose.covariance[:3, :3]
        distance_sd = float(np.sqrt(d @ np.linalg.solve(S, d)))
        if distance_sd > MAX_MOVE_SD:
            detail = (
                f"triad {number} along the spine: the edits moved it by {np.linalg.norm(d):.1f} mm, {distance_sd:.0f}"
                " sd of both poses, and it was found in full view before; compare both takes"
            )
            flags.append(Flag("triad-moved-by-edit", detail))
    return tuple(flags)


def _shared(earlier: EarlierTriad, triad: MeasuredTriad) -> int:
    """Return how many images of balls two triads have in common."""
    count = 0
    for side in SIDES:
        seen = [ball.image_px(side) for ball in triad.balls.values()]
        now = np.array([image for image in seen if image is not None]).reshape(-1, 2)
        distance = np.linalg.norm(earlier.images_px[side][:, None] - now, axis=-1)
        count += int((distance < _SAME_PX).any(axis=1).sum())
    return count
