"""Centres: networks look at every promising feature and say what it is and where.

The scout, a small network, ranks the features. The judge, a larger one, looks at the best of them, three times. First,
at a few, for what all balls share but the rig does not tell: how large they are, since the wound may lie nearer or
further than where the cameras' axes meet, and where the lamp hangs. Then at all of them, knowing both; and at the
best once more, turned by half a turn: what a network gets wrong by itself is seldom the same the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spinewatch.arrays import Float, Single
from spinewatch.camera import Camera
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.lamp import Reflections, measured_lamp
from spinewatch.detection.refinement.networks import BallEstimates, BallNet, default_ball_nets, look
from spinewatch.detection.refinement.patches import cut_patches, patch_tone
from spinewatch.imaging.exposure import to_gray
from spinewatch.parallel import both


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of centres; lengths are in radii of the ball.

    ``judged``: how many of the best features of a view the judge looks at, ``asked`` of them first for what balls
    share, ``turned`` of them once more; ``kept``: how many are handed on. ``likely``: features count for what balls
    share that are balls with at least these odds, if there are ``min_likely`` of them. ``lamp_sd``: how far
    from midway between the cameras the lamp may hang, radians an axis. ``same``: features whose centres come closer
    than this are one. ``reach``: how far a centre may lie from its feature. ``alike``: correlation of the errors of a
    look and one that is turned, as on simulated pictures. ``misfit``: standard deviation per axis
    of what simulated pictures do not know of real ones. ``max_log_odds``: a network's log-odds count up to this, and a
    template's likeness of 1 as ``likeness`` of them: what looks like a ball to one may be a clot to the other.
    """

    judged: int = 60
    asked: int = 24
    turned: int = 24
    kept: int = 150
    likely: float = 3.0
    min_likely: int = 4
    lamp_sd: float = 0.11
    same: float = 0.4
    reach: float = 0.7
    alike: float = 0.8
    misfit: float = 0.008
    max_log_odds: float = 6.0
    likeness: float = 20.0


@dataclass(frozen=True, eq=False)
class CandidateView:
    """One camera's part: its 8- or 16-bit gray image (H, W), features, and the nominal (width, height) of balls.

    ``lamp`` (2,): the u and v components of the unit vector from the field to where the cart's lamp should hang.
    """

    camera: Camera
    image: NDArray[np.unsignedinteger]
    features: Features
    ball_px: tuple[float, float]
    lamp: Float


@dataclass(frozen=True, eq=False)
class Ranking:
    """A view's n features as the scout ranked them, and what the balls among them share.

    ``tone`` (H, W) of the image; ``centre`` (n, 2), px, ``covariance`` (n, 2, 2), px², ``visible`` (n,) and ``score``
    (n,) so far; ``ball`` (2,), px, the size of balls; ``reflections`` of the lamp in the likely ones.
    """

    view: CandidateView
    judge: BallNet
    tone: Single
    centre: Float
    covariance: Float
    visible: Float
    score: Float
    ball: Float
    reflections: Reflections


def rank_features(view: CandidateView, parameters: CentreParameters) -> Ranking:
    """Return a view's features as the scout ranks them, with the size of balls and the lamp by the best of them."""
    p, features, nets = parameters, view.features, default_ball_nets()
    tone, ball = patch_tone(to_gray(view.image)), np.array(view.ball_px)
    judge = nets.judge(view.ball_px[0])
    seen, centre = _look_at(_Look(nets.scout, tone, ball, view.lamp, False, p.reach), features.xy_px)
    covariance, score = _covariance(seen, ball), _score(seen, features.score, p)
    ratio = _size(seen, p)
    asked = np.argsort(-score, kind="stable")[: p.asked]
    # Balls that look larger are nearer, and there the lamp stands further from the camera's axis.
    first = _Look(judge, tone, ball * ratio, view.lamp * ratio, False, p.reach)
    answer, centre[asked] = _look_at(first, centre[asked])
    likely = answer.log_odds > np.log(p.likely)
    reflections = Reflections(view.camera, first.lamp, answer.lamp[likely], answer.lamp_sd[likely])
    ball = first.ball * _size(answer, p)
    return Ranking(view, judge, tone, centre, covariance, seen.visible, score, ball, reflections)


def settle_centres(
    rankings: tuple[Ranking, Ranking], parameters: CentreParameters
) -> tuple[Features, Features]:
    """Return the features of both views with centres, covariances and scores settled, likeliest balls first.

    The score joins the network's odds of a ball and the likeness of templates. Features that turn out to be the same
    ball are one.
    """
    known = max(len(r.reflections.sd) for r in rankings) >= parameters.min_likely
    lamps = measured_lamp([r.reflections for r in rankings], parameters.lamp_sd)
    left, right = zip(rankings, lamps, strict=True)
    return both(lambda part: _settle(*part, known, parameters), left, right)


def _settle(ranking: Ranking, lamp: Float, known: bool, p: CentreParameters) -> Features:
    r, ball = ranking, ranking.ball
    centre, covariance, visible, score = (a.copy() for a in (r.centre, r.covariance, r.visible, r.score))
    look = _Look(r.judge, r.tone, ball, lamp, known, p.reach)
    best = np.argsort(-score, kind="stable")[: p.judged]
    seen, centre[best] = _look_at(look, centre[best])
    covariance[best], visible[best] = _covariance(seen, ball), seen.visible
    score[best] = _score(seen, r.view.features.score[best], p)
    best = np.argsort(-score, kind="stable")[: p.turned]
    seen, again = _look_at(look, centre[best], turned=True)
    centre[best] = (centre[best] + again) / 2
    covariance[best] = (covariance[best] + _covariance(seen, ball)) / 2 * ((1 + p.alike) / 2)
    order = np.argsort(-score, kind="stable")
    order = order[_distinct(centre[order] / (ball / 2), p.same)][: p.kept]
    settled = centre[order] - outline_offsets(r.view.camera, centre[order], ball[0])
    unknown = np.diag(np.square(p.misfit * ball / 2))
    return Features(settled, score[order], covariance[order] + unknown, visible[order])


@dataclass(frozen=True, eq=False)
class _Look:
    """How to look: which network at which picture, the size of balls (2,), px, the lamp (2,) and is it measured."""

    net: BallNet
    tone: Single
    ball: Float
    lamp: Float
    known: bool
    reach: float


def _look_at(how: _Look, places: Float, turned: bool = False) -> tuple[BallEstimates, Float]:
    """Return what is seen at places (n, 2), px, and the centres (n, 2), px, of outlines; ``turned`` by half a turn."""
    pixel = np.rint(places).astype(np.intp)
    patches = cut_patches(how.tone, pixel, (how.ball[0], how.ball[1]), how.net.grid)
    way = -1 if turned else 1
    seen = look(how.net, patches[:, ::way, ::way], way * how.lamp, how.known)
    return seen, pixel + (way * seen.offset).clip(-how.reach, how.reach) * (how.ball / 2)


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


def _size(seen: BallEstimates, p: CentreParameters) -> float:
    """Return by what factor the likely balls of a view are larger than thought."""
    likely = seen.log_odds > np.log(p.likely)
    return float(np.exp(np.median(seen.log_size[likely]))) if likely.sum() >= p.min_likely else 1.0


def _score(seen: BallEstimates, likeness: Float, p: CentreParameters) -> Float:
    """Return scores (n,) in [0, 1]: a template's likeness counts as ``likeness`` log-odds of the network's."""
    odds = seen.log_odds.clip(-p.max_log_odds, p.max_log_odds)
    return np.asarray(
        (likeness + (odds + p.max_log_odds) / p.likeness) / (1 + 2 * p.max_log_odds / p.likeness)
    )


def _covariance(seen: BallEstimates, ball_px: Float) -> Float:
    return np.asarray(seen.covariance * np.outer(ball_px, ball_px) / 4)


def _distinct(places: Float, least: float) -> NDArray[np.intp]:
    """Return the indices of places (n, 2) that no earlier one is nearer to than ``least``."""
    kept = np.ones(len(places), dtype=bool)
    for first, later in sorted(cKDTree(places).query_pairs(least)):
        kept[later] &= not kept[first]
    return np.flatnonzero(kept)
