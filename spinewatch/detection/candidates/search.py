"""DETECT-POINT: from an image to its ball features (thesis chapter 4, appendix C)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spinewatch.detection.candidates.decision_space import (
    decision_space,
    feature_space,
    peaks,
    threshold_components,
)
from spinewatch.detection.candidates.property_spaces import Planes, PropertySpace, property_planes
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.surgical_field import FieldParameters, SurgicalField, surgical_field
from spinewatch.detection.candidates.templates import Side, TemplateSet, default_template_set
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.imaging.exposure import (
    Exposure,
    Gray,
    PreprocessParameters,
    correct_exposure,
    log_tone,
    reduce_image,
    to_gray,
    truncated_median_filter,
)


@dataclass(frozen=True)
class Comparison:
    """One template tree's part in the feature space: property space, measure, weight, and the root's gate.

    ``gate`` None compares with the root alone (the relaxed mode of section 7.2).
    """

    space: PropertySpace
    measure: Measure
    weight: float = 1.0
    gate: float | None = None


@dataclass(frozen=True)
class DetectionParameters:
    """Parameters of ``detect``.

    ``log_offset``: gray levels added before the logarithm; ``dark_blur_px``: smoothing of very dark images before
    it, whose noise the correction has raised. ``median``: apply the truncated median filter to the published
    spaces. ``scales``: ball sizes to look for, relative to the nominal. ``segmentation``: "peaks" or the thesis's
    "components"; ``budget``: features (or, for components, features expected, with ``pixels_per_feature`` each).
    ``score_floor``: least score of a peak. ``sigma_px``: standard deviation of a centre before it is refined.
    """

    preprocess: PreprocessParameters = field(default_factory=PreprocessParameters)
    field: FieldParameters = field(default_factory=FieldParameters)
    comparisons: tuple[Comparison, ...] = (Comparison(PropertySpace.DIRECTIVITY, Measure.CCN),)
    log_offset: float = 4.0
    dark_blur_px: float = 0.5
    median: bool = False
    scales: tuple[float, ...] = (1.03,)
    segmentation: Literal["peaks", "components"] = "peaks"
    budget: int = 250
    pixels_per_feature: int = 6
    score_floor: float = 0.2
    sigma_px: tuple[float, float] = (0.15, 0.15)


THESIS_1995 = DetectionParameters(
    comparisons=(
        Comparison(PropertySpace.GRAY, Measure.RHO, weight=1.0, gate=0.4),
        Comparison(PropertySpace.EDGE, Measure.CCM, weight=2.0, gate=0.4),
    ),
    median=True,
    scales=(1.0,),
    segmentation="components",
    budget=15,
)
"""The method as published: gray RHO and edge CCM, K = 2, representatives behind a root gate, budgeted components."""


@dataclass(frozen=True, eq=False)
class Detection:
    """Features of one image with the field that was searched, the kind of exposure and what is to be remarked."""

    features: Features
    field: SurgicalField
    exposure: Exposure
    flags: tuple[Flag, ...]


def detect(
    image: NDArray[Any],
    side: Side,
    ball_px: tuple[float, float],
    parameters: DetectionParameters,
    templates: TemplateSet | None = None,
) -> Detection:
    """Return the ball features of an 8- or 16-bit gray image (H, W), best first.

    ``side``: which camera took it. ``ball_px``: nominal (width, height) of a ball's image. Large images are
    reduced by a whole factor for the search, so that a ball is about as large as in the templates. Raises
    ``ImageError`` for an image of another kind.
    """
    templates = templates or default_template_set()
    gray = to_gray(image)
    whole = SurgicalField(0, 0, gray.shape[1], gray.shape[0])
    gray, exposure = correct_exposure(gray, parameters.preprocess)
    if exposure is Exposure.BLANK:
        return Detection(Features.empty(), whole, exposure, (Flag("blank-image", "the image is blank"),))
    factor = round(min(b / t for b, t in zip(ball_px, templates.diameter_px, strict=True)))
    factor = max(1, min(factor, *gray.shape))
    small = reduce_image(gray, factor)
    ball = (ball_px[0] / factor, ball_px[1] / factor)
    blur_px = parameters.dark_blur_px if exposure is Exposure.VERY_DARK else 0.0
    gradient = property_planes(log_tone(small, parameters.log_offset, blur_px), PropertySpace.DIRECTIVITY)
    activity = np.abs(gradient[0])
    activity += np.abs(gradient[1])
    box = surgical_field(activity, _field_parameters(parameters.field, ball, templates))
    crop = np.s_[..., box.v0 : box.v1, box.u0 : box.u1]
    space = _search(small[crop], gradient[crop], side, ball, templates, parameters)
    xy, score = _segment(space, ball, parameters)
    xy = (xy + np.array([box.u0, box.v0])) * factor + (factor - 1) / 2
    box = SurgicalField(*(factor * edge for edge in (box.u0, box.v0, box.u1, box.v1)))
    flags = () if len(xy) else (Flag("no-features", "nothing in the image resembles a ball"),)
    return Detection(
        _features(xy, score, factor, parameters), box, exposure, flags + _exposure_flags(exposure)
    )


def _search(
    gray: Gray,
    gradient: Planes,
    side: Side,
    ball_px: tuple[float, float],
    templates: TemplateSet,
    parameters: DetectionParameters,
) -> NDArray[np.floating]:
    """Return the feature space of the field: the weighted mean of the decision spaces, each over all ball sizes.

    The published spaces, gray level and edge magnitude, see the gray image; the directivity is that of its logarithm.
    """
    if parameters.median:
        gray = truncated_median_filter(gray)
    across, down = (b / t for b, t in zip(ball_px, templates.diameter_px, strict=True))
    sizes = [(across * scale, down * scale) for scale in parameters.scales]
    decisions = []
    for c in parameters.comparisons:
        planes = gradient if c.space is PropertySpace.DIRECTIVITY else property_planes(gray, c.space)
        decisions.append(
            decision_space(planes, templates.trees[side, c.space].scaled(sizes), c.measure, c.gate)
        )
    return feature_space(decisions, [c.weight for c in parameters.comparisons])


def _segment(
    space: NDArray[np.floating], ball_px: tuple[float, float], parameters: DetectionParameters
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    if parameters.segmentation == "components":
        return threshold_components(space, parameters.budget * parameters.pixels_per_feature)
    # Two balls cannot be closer than about half a diameter without one hiding the other.
    radius = max(1, round(min(ball_px) / 3))
    return peaks(space, parameters.budget, radius, parameters.score_floor)


def _field_parameters(
    parameters: FieldParameters, ball_px: tuple[float, float], templates: TemplateSet
) -> FieldParameters:
    ratio = max(b / t for b, t in zip(ball_px, templates.diameter_px, strict=True))
    return replace(parameters, segment_px=max(1, round(parameters.segment_px * ratio)))


def _features(
    xy: NDArray[np.floating], score: NDArray[np.floating], factor: int, parameters: DetectionParameters
) -> Features:
    covariance = np.diag(np.square(parameters.sigma_px)) * factor**2
    return Features(xy.astype(np.float64), score.astype(np.float64), np.tile(covariance, (len(xy), 1, 1)))


def _exposure_flags(exposure: Exposure) -> tuple[Flag, ...]:
    if exposure is Exposure.GLARE:
        return (
            Flag("image-saturated", "much of the image is saturated; close the aperture or dim the lamp"),
        )
    if exposure is Exposure.VERY_DARK:
        return (Flag("image-dark", "the image is very dark; open the aperture or brighten the lamp"),)
    return ()
