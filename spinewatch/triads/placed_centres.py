"""Centres that a person placed, beside what was detected: of each ball of a triad, and of the balls together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.detection.placed_centres import PlacedCentre, compared, not_used
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES, Side
from spinewatch.triads.pose import MeasuredTriad


def compare_placed_centres(
    triads: Sequence[MeasuredTriad],
    detected: tuple[Features | None, Features | None],
    ball_px: tuple[tuple[float, float], tuple[float, float]],
    parameters: CentreParameters,
) -> tuple[tuple[MeasuredTriad, ...], tuple[Flag, ...]]:
    """Return triads whose placed balls tell their distance from what was detected, and flags of those that are far.

    Parameters
    ----------
    triads
        The triads.
    detected
        Features like balls of the left and the right image before the edits of a person; None without edits.
    ball_px
        Nominal width and height of a ball in the left and in the right image, px.
    parameters
        Limits.

    Returns
    -------
    triads : tuple of MeasuredTriad
        The triads in the same order.
    flags : tuple of Flag
        "centre-displaced" for each image of a triad with a placed centre far from the feature that it may have been
        meant for, or with centres displaced together.
    """
    found, flags = list(triads), []
    for view, (side, features) in enumerate(zip(SIDES, detected, strict=True)):
        if features is None:
            continue
        radius = np.array(ball_px[view]) / 2
        free = not_used(features, _used_px(found, side), radius, parameters.merge_radius)
        for k, triad in enumerate(found):
            names = [name for name, ball in triad.balls.items() if side in ball.manual_in]
            if triad.pose is None or not names:
                continue
            placed_px = np.array([triad.balls[name].image_px(side) for name in names])
            centres, together = compared(placed_px, free, radius, parameters)
            balls = dict(triad.balls)
            for name, centre in zip(names, centres, strict=True):
                balls[name] = replace(balls[name], placed={**balls[name].placed, side: centre})
            found[k] = replace(triad, balls=balls)
            text = _text(dict(zip(names, centres, strict=True)), parameters.placed.max_sd, together=together)
            if text is not None:
                flags.append(Flag("centre-displaced", f"triad {k + 1} along the spine, {side} image: {text}"))
    return tuple(found), tuple(flags)


def _used_px(triads: Sequence[MeasuredTriad], side: Side) -> Float:
    """Return the centres (m, 2) of the balls in an image that no person placed there, of triads with a pose."""
    images = [
        ball.image_px(side)
        for triad in triads
        if triad.pose is not None
        for ball in triad.balls.values()
        if side not in ball.manual_in
    ]
    return np.array([image for image in images if image is not None]).reshape(-1, 2)


def _text(centres: dict[str, PlacedCentre], max_sd: float, *, together: bool) -> str | None:
    far = {
        name: centre
        for name, centre in centres.items()
        if centre.distance_sd is not None and (together or centre.distance_sd > max_sd)
    }
    if not far:
        return None
    each = ", ".join(
        f"{name} by {centre.distance_px:.1f} px, {centre.distance_sd:.0f} sd" for name, centre in far.items()
    )
    how = (
        "all placed centres are displaced together from detected features like balls"
        if together
        else ("placed beside a detected feature like a ball that no triad uses")
    )
    return f"{how}: {each}; compare them with the image, or take the edits back"
