"""Centres of balls: the network looks at every promising feature, twice, and says what it is and where.

The first look ranks the features and measures what all balls of a view share but the rig does not tell: how large they
are, since the wound may lie nearer or further than where the cameras' axes meet, and where the lamp hangs, whose
reflection is the sharpest mark on a ball but not at its centre. The second look knows both, and starts where the first
one found the centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spinewatch.camera import Camera
from spinewatch.detection.ball_net import BallNet, Sightings, default_ball_nets, look, net_for
from spinewatch.detection.patches import cut_patches, patch_tone
from spinewatch.detection.preprocess import to_gray
from spinewatch.features import Features

Float = NDArray[np.float64]


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of ``refine_centres``; lengths are in radii of the ball.

    ``second``: how many of the best features of a view are looked at twice; ``kept``: how many are handed on.
    ``likely``: features count for what balls share that are balls with at least these odds, if there are
    ``least_likely`` of them. ``same``: features whose centres come closer than this are one. ``reach``: how far
    a centre may lie from its feature. ``misfit``: standard deviation per axis of what simulated pictures do not
    know of real ones. ``limb``: the same, known: path-traced balls lie this times the lamp's direction further
    from the lamp than one bounce of light makes believe. ``most_odds``: the network's log-odds count up to
    this, and a template's likeness of 1 as ``likeness`` of them: what looks like a ball to one may be a clot to
    the other.
    """

    second: int = 60
    kept: int = 150
    likely: float = 3.0
    least_likely: int = 4
    same: float = 0.4
    reach: float = 0.7
    misfit: float = 0.008
    limb: float = 0.05
    most_odds: float = 6.0
    likeness: float = 20.0


@dataclass(frozen=True, eq=False)
class View:
    """One camera's part: its 8- or 16-bit gray image (H, W), features, and the nominal (width, height) of balls.

    ``lamp`` (2,): the u and v components of the unit vector from the field to where the cart's lamp should hang.
    """

    camera: Camera
    image: NDArray[np.unsignedinteger]
    features: Features
    ball_px: tuple[float, float]
    lamp: Float


def refine_centres(
    view: View, parameters: CentreParameters, nets: Sequence[BallNet] | None = None
) -> Features:
    """Return a view's features with centres, covariances and scores settled, likeliest balls first.

    The score joins the network's odds of a ball and the likeness of templates. Features that turn out to be the same
    ball are one.
    """
    p, features = parameters, view.features
    if not len(features):
        return features
    tone = patch_tone(to_gray(view.image))
    net = net_for(nets or default_ball_nets(), view.ball_px[0])

    def look_at(places: Float, ball: Float, lamp: Float, known: bool) -> tuple[Sightings, Float]:
        pixel = np.rint(places).astype(np.intp)
        sightings = look(net, cut_patches(tone, pixel, (ball[0], ball[1]), net.grid), lamp, known)
        offset = sightings.offset.clip(-p.reach, p.reach) - p.limb * lamp
        return sightings, pixel + offset * (ball / 2)

    nominal = np.array(view.ball_px)
    seen, centre = look_at(features.xy_px, nominal, view.lamp, False)
    covariance = _covariance(seen, nominal, p)
    ball, lamp, known = _common(seen, nominal, view.lamp, p)
    twice = np.argsort(-_score(seen, features.score, p), kind="stable")[: p.second]
    again, settled = look_at(centre[twice], ball, lamp, known)
    centre[twice], covariance[twice] = settled, _covariance(again, ball, p)
    score = _score(seen, features.score, p)
    score[twice] = _score(again, features.score[twice], p)
    order = np.argsort(-score, kind="stable")
    order = order[_distinct(centre[order] / (ball / 2), p.same)][: p.kept]
    outline = centre[order]
    return Features(outline - outline_offsets(view.camera, outline, ball[0]), score[order], covariance[order])


def outline_offsets(camera: Camera, outline_px: Float, width_px: float) -> Float:
    """Return by how much (n, 2), px, the centres of outlines at pixels (n, 2) lie off the images of the balls' centres.

    A ball's outline is the section of a cone that opens by its apparent radius a about the line of sight, at the
    angle t from the axis; that ellipse's centre is ``tan t tan²a (1 + tan²t) / (1 - tan²t tan²a)`` further out than
    the image of the cone's axis. ``width_px`` of a ball's image near the axis.
    """
    pitch = np.array(camera.pixel_size_mm)
    ideal = camera.undistort(camera.plate(outline_px))
    tan2_t = np.square(ideal / camera.focal_length_mm).sum(axis=1, keepdims=True)
    tan2_a = (width_px * pitch[0] / 2 / camera.focal_length_mm) ** 2
    outwards = ideal * tan2_a * (1 + tan2_t) / (1 - tan2_t * tan2_a)
    return np.asarray(outwards / (pitch * (1, -1)))


def _common(
    seen: Sightings, nominal_px: Float, lamp: Float, p: CentreParameters
) -> tuple[Float, Float, bool]:
    """Return what a view's likely balls share: their size in px, the lamp's place, and whether that is known."""
    likely = seen.log_odds > np.log(p.likely)
    if likely.sum() < p.least_likely:
        return nominal_px, lamp, False
    size = np.exp(np.median(seen.log_size[likely]))
    weight = seen.lamp_sd[likely] ** -2.0
    place = weight @ seen.lamp[likely] / weight.sum()
    return nominal_px * size, place, True


def _score(seen: Sightings, likeness: Float, p: CentreParameters) -> Float:
    """Return scores (n,) in [0, 1]: a template's likeness counts as ``likeness`` log-odds of the network's."""
    odds = seen.log_odds.clip(-p.most_odds, p.most_odds)
    return np.asarray((likeness + (odds + p.most_odds) / p.likeness) / (1 + 2 * p.most_odds / p.likeness))


def _covariance(seen: Sightings, ball_px: Float, p: CentreParameters) -> Float:
    radii = ball_px / 2
    return np.asarray((seen.covariance + p.misfit**2 * np.eye(2)) * np.outer(radii, radii))


def _distinct(places: Float, least: float) -> NDArray[np.intp]:
    """Return the indices of places (n, 2) that no earlier one is nearer to than ``least``."""
    kept = np.ones(len(places), dtype=bool)
    for first, later in sorted(cKDTree(places).query_pairs(least)):
        kept[later] &= not kept[first]
    return np.flatnonzero(kept)
