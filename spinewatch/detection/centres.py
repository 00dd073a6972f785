"""Centres of balls: what correlation, outline and highlight say, weighed against each other over both views.

Each cue has its own fault. Correlation is steady but carries a shift common to a view, since it follows the reflection
for which its template was made. The outline has no such shift but suffers from what lies behind a ball. The highlight
is sharpest of all, but lies off the centre by an amount that depends on where the lamp hangs. The lamp is the same for
all balls of both views, so it is found first; the shifts follow; then each ball's cues are averaged.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from spinewatch.camera import Camera
from spinewatch.detection.highlight import (
    HighlightParameters,
    Reflectors,
    find_highlights,
    highlight_offsets,
    reflectors,
)
from spinewatch.detection.outline import OutlineParameters, fit_outlines
from spinewatch.detection.preprocess import reduce_image, to_gray
from spinewatch.features import Features

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

_BALL_PX = 9.0
_PIXEL = 12**-0.5
"""Standard deviation of the light-gathering area of a pixel, in pixels."""


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of ``refine_centres``; lengths are in pixels of a ball nine pixels wide.

    ``refined``: so many of the best features of a view are looked at closely; the others only lose the view's
    shift. ``lens_px``: blur of the lens, standard deviation in pixels of the full image. ``sure_score``: balls
    count for lamp and shifts whose score is at least this fraction of the fifth best; ``least_sure``: how many
    of these it takes. ``lamp_sd_mm``: how far from the middle between the cameras the lamp may hang, per axis.
    ``template_sd_px`` and ``highlight_sd_px``: least standard deviations of these cues; ``outline_floor_px`` of
    the outline. ``common_sd_px``: what remains of a view's shift. ``gate_sigma``: a highlight further off than
    this is left out. ``misfit_sd_px``: how far outline and highlight of one ball usually disagree;
    ``agreement_sigma``: how far they may disagree about a whole view.
    """

    refined: int = 40
    lens_px: float = 0.53
    outline: OutlineParameters = field(default_factory=OutlineParameters)
    highlight: HighlightParameters = field(default_factory=HighlightParameters)
    sure_score: float = 0.75
    least_sure: int = 5
    lamp_sd_mm: tuple[float, float, float] = (150.0, 150.0, 200.0)
    template_sd_px: float = 0.2
    highlight_sd_px: float = 0.1
    outline_floor_px: float = 0.2
    common_sd_px: float = 0.06
    gate_sigma: float = 4.0
    misfit_sd_px: float = 0.25
    agreement_sigma: float = 3.0


@dataclass(frozen=True, eq=False)
class View:
    """One camera's part: its gray image (H, W), its features, and where balls are: size in pixels, range in mm."""

    camera: Camera
    image: NDArray[np.unsignedinteger]
    features: Features
    ball_px: tuple[float, float]
    range_mm: float


@dataclass(frozen=True, eq=False)
class Centres:
    """Features of both views, and the lamp's place (3,) in object space, mm; None where no lamp shows."""

    left: Features
    right: Features
    lamp_mm: Float | None


@dataclass(frozen=True, eq=False)
class _Cues:
    """Places (n, 2) of a view's features by three cues, in pixels of an image reduced by ``factor``.

    By correlation; by outline, with variances (n, 2), infinite where there is none; by highlight, where (n,) present.
    ``sure`` (n,): which features are balls almost certainly.
    """

    template: Float
    outline: Float
    outline_var: Float
    highlight: Float
    present: Bool
    sure: Bool
    factor: int


def refine_centres(left: View, right: View, radius_mm: float, parameters: CentreParameters) -> Centres:
    """Return the features of both views with their centres and covariances settled; balls have ``radius_mm``.

    Large images are reduced by a whole factor first, so that a ball is about nine pixels wide.
    """
    views = (left, right)
    cues = _measure_cues(left, parameters), _measure_cues(right, parameters)
    balls = [reflectors(v.camera, v.features.xy_px, v.range_mm, radius_mm) for v in views]
    lamp = _locate_lamp(cues, balls, (left.camera.centre + right.camera.centre) / 2, parameters)
    a, b = (
        _combine(
            view.features,
            seen,
            None if lamp is None else highlight_offsets(ball, lamp) / seen.factor,
            parameters,
        )
        for view, seen, ball in zip(views, cues, balls, strict=True)
    )
    return Centres(a, b, lamp)


def _measure_cues(view: View, p: CentreParameters) -> _Cues:
    factor = max(1, min(round(view.ball_px[0] / _BALL_PX), *view.image.shape))
    small = reduce_image(to_gray(view.image), factor)
    ball = (view.ball_px[0] / factor, view.ball_px[1] / factor)
    xy = (view.features.xy_px - (factor - 1) / 2) / factor
    near = xy[: p.refined]
    blur = float(np.hypot(_PIXEL, p.lens_px / factor))
    outline = fit_outlines(small, near, ball, replace(p.outline, blur_px=blur))
    highlight = find_highlights(small, near, outline.contrast, ball, p.highlight)
    outline_xy, outline_var, highlight_xy = xy.copy(), np.full(xy.shape, np.inf), xy.copy()
    present = np.zeros(len(xy), dtype=bool)
    variance = outline.covariance_px2[:, [0, 1], [0, 1]] + p.outline_floor_px**2
    outline_xy[: p.refined], highlight_xy[: p.refined] = outline.xy_px, highlight.xy_px
    outline_var[: p.refined] = np.where(np.isfinite(variance), variance, np.inf)
    present[: p.refined] = highlight.present
    return _Cues(xy, outline_xy, outline_var, highlight_xy, present, _sure(view.features.score, p), factor)


def _sure(score: Float, p: CentreParameters) -> Bool:
    if len(score) < p.least_sure:
        return np.zeros(len(score), dtype=bool)
    return np.asarray(score >= p.sure_score * np.sort(score)[-p.least_sure])


def _locate_lamp(
    views: tuple[_Cues, _Cues], balls: list[Reflectors], middle_mm: Float, p: CentreParameters
) -> Float | None:
    """Return the lamp (3,) whose highlights agree best with the outlines of both views."""
    known = [c.sure & c.present for c in views]
    if sum(int(k.sum()) for k in known) < 2 * p.least_sure:
        return None
    seen = [(c.highlight - c.outline)[k] * c.factor for c, k in zip(views, known, strict=True)]
    some = [b.take(k) for b, k in zip(balls, known, strict=True)]
    sd_px = [p.misfit_sd_px * c.factor for c in views]

    def misfit(lamp: Float) -> Float:
        miss = [
            (s - highlight_offsets(b, lamp)).ravel() / sd for s, b, sd in zip(seen, some, sd_px, strict=True)
        ]
        return np.concatenate([*miss, (lamp - middle_mm) / p.lamp_sd_mm])

    # A millimetre of the lamp moves a highlight by a thousandth of a pixel.
    return np.asarray(least_squares(misfit, middle_mm, loss="cauchy", x_scale=100.0, xtol=1e-3, ftol=1e-4).x)


def _combine(features: Features, cues: _Cues, offset: Float | None, p: CentreParameters) -> Features:
    """Return the weighted means of a view's cues, each rid of the shift common to the view."""
    highlight = cues.highlight if offset is None else cues.highlight - offset
    lit = cues.sure & cues.present & (offset is not None)
    shift, trusted = _shift(cues, highlight, lit, p)
    template = cues.template + shift
    template_var = np.full(template.shape, p.template_sd_px**2)
    highlight_var = np.full(template.shape, _spread(highlight - template, lit, p) ** 2)
    # Correlation and outline say where the ball must be; a highlight elsewhere is another lamp's.
    middle, middle_var = _mean((template, template_var), (cues.outline, cues.outline_var))
    far = np.abs(highlight - middle) > p.gate_sigma * np.sqrt(middle_var + highlight_var)
    highlight_var[far.any(axis=1) | ~(cues.present & trusted)] = np.inf
    centre, variance = _mean(
        (template, template_var), (cues.outline, cues.outline_var), (highlight, highlight_var)
    )
    covariance = np.zeros((len(centre), 2, 2))
    doubt = _doubt((template - cues.outline)[cues.sure], (template_var + cues.outline_var)[cues.sure])
    covariance[:, [0, 1], [0, 1]] = (doubt * variance + p.common_sd_px**2) * cues.factor**2
    return Features(centre * cues.factor + (cues.factor - 1) / 2, features.score, covariance)


def _shift(cues: _Cues, highlight: Float, lit: Bool, p: CentreParameters) -> tuple[Float, bool]:
    """Return the shift (2,) of correlation that is common to a view, and whether highlights may be trusted in it.

    Outlines and highlights must agree about it. Where they do not, other lamps shine brighter than the one found.
    """
    if not cues.sure.any():
        return np.zeros(2), False
    by_outline = np.median((cues.outline - cues.template)[cues.sure], axis=0)
    outline_var = 1.57 * p.misfit_sd_px**2 / cues.sure.sum()  # of a median
    if lit.sum() < p.least_sure:
        return by_outline, False
    by_highlight = np.median((highlight - cues.template)[lit], axis=0)
    highlight_var = p.highlight_sd_px**2
    apart = np.abs(by_highlight - by_outline) / np.sqrt(outline_var + highlight_var)
    if apart.max() > p.agreement_sigma:
        return by_outline, False
    return _mean((by_outline, np.full(2, outline_var)), (by_highlight, np.full(2, highlight_var)))[0], True


def _spread(difference: Float, lit: Bool, p: CentreParameters) -> Float:
    """Return the standard deviation (2,) of this view's highlights, from how they scatter about the template."""
    if lit.sum() < p.least_sure:
        return np.full(2, p.highlight_sd_px)
    scatter = 1.4826 * np.median(np.abs(difference[lit]), axis=0)
    return np.asarray(np.sqrt(np.maximum(scatter**2 - p.template_sd_px**2, p.highlight_sd_px**2)))


def _doubt(difference: Float, variance: Float) -> float:
    """Return by how much two cues of a view's balls differ more than their variances (n, 2) say, never less than 1.

    Grounds differ: beside coarse, high-contrast flesh all cues of a view are worse.
    """
    known = np.isfinite(variance)
    if not known.any():
        return 1.0
    chi2_of_one = 0.455  # median
    return max(1.0, float(np.median(difference[known] ** 2 / variance[known])) / chi2_of_one)


def _mean(*cues: tuple[Float, Float]) -> tuple[Float, Float]:
    """Return the weighted mean of (value, variance) pairs and its variance."""
    total = np.asarray(sum(1 / variance for _, variance in cues))
    return np.asarray(sum(value / variance for value, variance in cues)) / total, 1 / total
