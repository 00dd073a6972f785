"""How far the centres that a person placed are from what was detected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.duplicates import same_ball


@dataclass(frozen=True)
class PlacedCentre:
    """A placed centre beside the nearest feature like a ball that no other ball of a triad uses.

    Attributes
    ----------
    xy_px
        The placed centre (u, v), px.
    feature_px
        The feature (u, v), px; None when none is within reach.
    distance_px
        Their distance, px; None without a feature.
    distance_sd
        The distance in standard deviations of a centre that was placed on the feature; None without one.
    """

    xy_px: tuple[float, float]
    feature_px: tuple[float, float] | None = None
    distance_px: float | None = None
    distance_sd: float | None = None


def like_balls(features: Features, parameters: CentreParameters) -> Features:
    """Return the features that a detector found and that are like balls.

    Parameters
    ----------
    features
        Features of an image.
    parameters
        Least score.

    Returns
    -------
    Features
        Those of them, without what a person placed.
    """
    return features.take(
        np.flatnonzero((features.score >= parameters.placed.min_score) & ~features.is_manual)
    )


def not_used(detected: Features, used_px: Float, radius_px: Float, merge_radius: float) -> Features:
    """Return the features that are not of the same ball as any of other centres.

    Parameters
    ----------
    detected
        Features of an image.
    used_px
        The other centres (u, v), shape (m, 2), px.
    radius_px
        Radii of a ball along u and v, shape (2,), px.
    merge_radius
        Centres that are closer than this are of the same ball, radii.

    Returns
    -------
    Features
        The others.
    """
    used = same_ball(detected.xy_px, used_px, radius_px, merge_radius).any(axis=1)
    return detected.take(np.flatnonzero(~used))


def placed_covariances(
    placed_px: Float, detected: Features, radius_px: Float, parameters: CentreParameters
) -> Float:
    """Return the covariances of centres that a person placed.

    Parameters
    ----------
    placed_px
        The centres (u, v), shape (n, 2), px.
    detected
        Features like balls that the centres replace.
    radius_px
        Radii of a ball along u and v, shape (2,), px.
    parameters
        Deviations and reach.

    Returns
    -------
    Float
        Covariances, shape (n, 2, 2), px^2: those of a person's hand on a feature; wider where none is within reach, so
        that the mean of all such centres is as uncertain as one of them; and where a feature is farther than a hand
        explains, with the square of the distance along it, because either may be the ball.

    Examples
    --------
    >>> detected = Features.with_sigma(np.array([[10.0, 20.0]]), np.ones(1), 0.1)
    >>> placed = np.array([[10.0, 20.0], [14.0, 20.0], [90.0, 20.0]])
    >>> S = placed_covariances(placed, detected, np.array([5.0, 5.0]), CentreParameters())
    >>> np.sqrt(S[:, 0, 0]).round(1).tolist(), np.sqrt(S[:, 1, 1]).round(1).tolist()
    ([0.6, 4.0, 1.0], [0.6, 0.6, 1.0])
    """
    p = parameters
    hand, unconfirmed = (np.diag(np.square(sd * radius_px)) for sd in (p.manual_sd, p.placed.unconfirmed_sd))
    nearest = [_nearest(xy, detected, radius_px, p.placed.reach) for xy in placed_px]
    # their errors may be common; as many times the variance makes the mean as uncertain as one of them
    covariances = np.tile(nearest.count(None) * unconfirmed, (len(placed_px), 1, 1))
    for k, i in enumerate(nearest):
        if i is None:
            continue
        d = detected.xy_px[i] - placed_px[k]
        far = _distance_sd(d, hand + detected.covariance_px2[i]) > p.placed.max_sd
        covariances[k] = hand + far * np.outer(d, d)
    return covariances


def compared(
    placed_px: Float, detected: Features, radius_px: Float, parameters: CentreParameters
) -> tuple[tuple[PlacedCentre, ...], bool]:
    """Return placed centres beside the features that they may have been meant for.

    Parameters
    ----------
    placed_px
        Placed centres of the balls of one triad in one image (u, v), shape (n, 2), px.
    detected
        Features like balls that no other ball of a triad uses.
    radius_px
        Radii of a ball along u and v, shape (2,), px.
    parameters
        Reach and limit.

    Returns
    -------
    comparisons : tuple of PlacedCentre
        One for each centre. The nearest feature, but that which one displacement of all centres gives where there is
        one.
    together : bool
        Whether the centres, two or more, are displaced together by more than their mean explains.

    Examples
    --------
    >>> detected = Features.with_sigma(np.array([[10.0, 20.0], [40.0, 25.0]]), np.ones(2), 0.1)
    >>> (one, other), together = compared(
    ...     np.array([[18.0, 20.0], [48.0, 25.0]]), detected, np.array([5.0, 5.0]), CentreParameters()
    ... )
    >>> one.distance_px, round(other.distance_sd), together
    (8.0, 13, True)
    """
    p, n = parameters, len(placed_px)
    hand = np.diag(np.square(p.manual_sd * radius_px))
    partners = [_nearest(xy, detected, radius_px, p.placed.reach) for xy in placed_px]
    together = False
    if n > 1 and (found := _displaced_together(placed_px, detected, radius_px, p)) is not None:
        partners = list(found)
        offset = (detected.xy_px[found] - placed_px).mean(axis=0)
        S = (hand + detected.covariance_px2[found].mean(axis=0)) / n
        together = _distance_sd(offset, S) > p.placed.max_sd
    return (
        tuple(
            PlacedCentre((float(u), float(v)))
            if i is None
            else _comparison((float(u), float(v)), detected, i, hand)
            for (u, v), i in zip(placed_px, partners, strict=True)
        ),
        together,
    )


def _comparison(xy: tuple[float, float], detected: Features, i: int, hand: Float) -> PlacedCentre:
    u, v = detected.xy_px[i]
    d = detected.xy_px[i] - xy
    S = hand + detected.covariance_px2[i]
    return PlacedCentre(xy, (float(u), float(v)), float(np.hypot(*d)), _distance_sd(d, S))


def _displaced_together(
    placed_px: Float, detected: Features, radius_px: Float, p: CentreParameters
) -> list[int] | None:
    """Return a different feature for each centre, all displaced alike to within a hand, by as little as possible."""
    if not len(detected):
        return None
    offsets = (detected.xy_px - placed_px[0]) / radius_px
    near = np.flatnonzero(np.hypot(*offsets.T) <= p.placed.group_reach)
    tolerance = p.placed.max_sd * p.manual_sd * np.sqrt(2)
    for i in near[np.argsort(np.hypot(*offsets[near].T))]:
        moved = placed_px + detected.xy_px[i] - placed_px[0]
        distance = np.linalg.norm((moved[:, None] - detected.xy_px) / radius_px, axis=-1)
        partners = distance.argmin(axis=1)
        if (distance.min(axis=1) <= tolerance).all() and len(set(partners.tolist())) == len(placed_px):
            return [int(k) for k in partners]
    return None


def _nearest(xy: Float, detected: Features, radius_px: Float, reach: float) -> int | None:
    if not len(detected):
        return None
    distance = np.hypot(*((detected.xy_px - xy) / radius_px).T)
    i = int(distance.argmin())
    return i if distance[i] <= reach else None


def _distance_sd(offset_px: Float, covariance_px2: Float) -> float:
    return float(np.sqrt(offset_px @ np.linalg.solve(covariance_px2, offset_px)))
