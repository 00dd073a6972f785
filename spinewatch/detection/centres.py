"""Centres of balls: networks look at every promising feature and say what it is and where.

The scout, a small network, ranks the features and measures what all balls of a view share but the rig does not tell:
how large they are, since the wound may lie nearer or further than where the cameras' axes meet, and where the lamp
hangs, whose reflection is the sharpest mark on a ball but not at its centre. The judge, a larger one, looks at the best
of them, knows both, and starts where the scout found the centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spinewatch.camera import Camera
from spinewatch.detection.ball_net import BallNet, BallNets, Sightings, default_ball_nets, look
from spinewatch.detection.patches import cut_patches, patch_tone
from spinewatch.detection.preprocess import to_gray
from spinewatch.features import Features

Float = NDArray[np.float64]


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of ``refine_centres``; lengths are in radii of the ball.

    ``judged``: how many of the best features of a view the judge looks at; ``kept``: how many are handed on.
    ``likely``: features count for what balls share that are balls with at least these odds, if there are
    ``least_likely`` of them. ``same``: features whose centres come closer than this are one. ``reach``: how far
    a centre may lie from its feature. ``misfit``: standard deviation per axis of what simulated pictures do not
    know of real ones. ``most_odds``: a network's log-odds count up to this, and a template's likeness of 1 as
    ``likeness`` of them: what looks like a ball to one may be a clot to the other.
    """

    judged: int = 60
    kept: int = 150
    likely: float = 3.0
    least_likely: int = 4
    same: float = 0.4
    reach: float = 0.7
    misfit: float = 0.008
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


def refine_centres(view: View, parameters: CentreParameters, nets: BallNets | None = None) -> Features:
    """Return a view's features with centres, covariances and scores settled, likeliest balls first.

    The score joins the network's odds of a ball and the likeness of templates. Features that turn out to be the same
    ball are one.
    """
    p, features = parameters, view.features
    if not len(features):
        return features
    nets = nets or default_ball_nets()
    tone = patch_tone(to_gray(view.image))

    def look_at(
        net: BallNet, places: Float, ball: Float, lamp: Float, known: bool
    ) -> tuple[Sightings, Float]:
        pixel = np.rint(places).astype(np.intp)
        sightings = look(net, cut_patches(tone, pixel, (ball[0], ball[1]), net.grid), lamp, known)
        return sightings, pixel + sightings.offset.clip(-p.reach, p.reach) * (ball / 2)

    nominal = np.array(view.ball_px)
    scouted, centre = look_at(nets.scout, features.xy_px, nominal, view.lamp, False)
    covariance, visible = _covariance(scouted, nominal, p), scouted.visible
    score = _score(scouted, features.score, p)
    ball, lamp, known = _common(scouted, nominal, view.lamp, p)
    best = np.argsort(-score, kind="stable")[: p.judged]
    judge = nets.judge(view.ball_px[0])
    judged, centre[best] = look_at(judge, centre[best], ball, lamp, known)
    covariance[best], visible[best] = _covariance(judged, ball, p), judged.visible
    score[best] = _score(judged, features.score[best], p)
    order = np.argsort(-score, kind="stable")
    order = order[_distinct(centre[order] / (ball / 2), p.same)][: p.kept]
    settled = centre[order] - outline_offsets(view.camera, centre[order], ball[0])
    return Features(settled, score[order], covariance[order], visible[order])


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
