"""Search for ball candidates by template correlation (DETECT-POINT; thesis chapter 4, appendix C)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Floating, Single
from spinewatch.detection.candidates.decision_space import decision_space, feature_space
from spinewatch.detection.candidates.property_spaces import PropertySpace, property_planes
from spinewatch.detection.candidates.segmentation import peaks
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.surgical_field import FieldParameters, SurgicalField, surgical_field
from spinewatch.detection.candidates.templates import TemplateSet, TemplateTree, default_template_set
from spinewatch.detection.features import DiscardedCandidates, Features
from spinewatch.flags import Flag
from spinewatch.imaging.exposure import Exposure, ExposureParameters, correct_exposure
from spinewatch.imaging.frame import Frame, Side
from spinewatch.imaging.pyramid import reduce_image
from spinewatch.imaging.quality import SOUND, ImageQuality, QualityParameters, assess_image
from spinewatch.imaging.sharpness import SharpnessParameters
from spinewatch.imaging.tone import defective_pixels, log_tone


@dataclass(frozen=True)
class Comparison:
    """One template tree's contribution to the feature space.

    Attributes
    ----------
    space
        Property space.
    measure
        Measure of similarity.
    weight
        Weight in the feature space.
    """

    space: PropertySpace
    measure: Measure
    weight: float = 1.0


@dataclass(frozen=True)
class DetectionParameters:
    """Parameters of `detect`.

    Attributes
    ----------
    exposure
        Correction of the exposure.
    quality
        Thresholds of the quality of images.
    sharpness
        Thresholds of the sharpness of images at the balls.
    field
        Surgical field; its ``segment_px`` is that of the 1995 cart and is scaled with the size of the balls.
    comparisons
        Comparisons whose weighted mean is the feature space.
    log_offset
        Gray levels added before the logarithm.
    dark_blur_px
        Standard deviation of the Gaussian filter of very dark images before the logarithm, px; the correction of their
        exposure has amplified noise.
    scales
        Ball sizes that are searched for, relative to the nominal one.
    max_features
        Number of features to return at most.
    peak_radius
        Half side of the neighbourhood of a maximum, as a fraction of the smaller of a ball's width and
        height. Two balls closer than half a diameter hide each other.
    min_score
        Least score.
    sigma_px
        Standard deviation of a feature's position before refinement, (u, v), px of the searched image.
    """

    exposure: ExposureParameters = field(default_factory=ExposureParameters)
    quality: QualityParameters = field(default_factory=QualityParameters)
    sharpness: SharpnessParameters = field(default_factory=SharpnessParameters)
    field: FieldParameters = field(default_factory=FieldParameters)
    comparisons: tuple[Comparison, ...] = (Comparison(PropertySpace.DIRECTIVITY, Measure.CCN),)
    log_offset: float = 4.0
    dark_blur_px: float = 0.5
    scales: tuple[float, ...] = (1.03,)
    max_features: int = 250
    peak_radius: float = 1 / 3
    min_score: float = 0.2
    sigma_px: tuple[float, float] = (0.15, 0.15)


_NONE_DISCARDED = DiscardedCandidates.empty()


@dataclass(frozen=True, eq=False)
class Detection:
    """Features found in one image.

    Attributes
    ----------
    features
        Possible ball centres, best first.
    field
        Part of the image that was searched.
    exposure
        Kind of exposure.
    flags
        Remarks on the image.
    quality
        Quality of the image; its flags are among the flags.
    discarded
        Candidates that are no features; none before refinement.
    detected
        Features like balls that were detected before a person edited the centres; None without edits.
    """

    features: Features
    field: SurgicalField
    exposure: Exposure
    flags: tuple[Flag, ...]
    quality: ImageQuality = SOUND
    discarded: DiscardedCandidates = _NONE_DISCARDED
    detected: Features | None = None


@dataclass(frozen=True, eq=False)
class CandidateMaps:
    """What an image becomes on the way to its features, at the reduced size.

    Attributes
    ----------
    tone
        Log gray levels after the correction of the exposure, shape (H, W).
    activity
        Sum of the magnitudes of the gradient along u and v, shape (H, W).
    field
        Surgical field, reduced px.
    feature_space
        Similarity to a ball in the field, shape (h, w).
    """

    tone: Floating
    activity: Floating
    field: SurgicalField
    feature_space: Floating


@dataclass(frozen=True, eq=False)
class CandidateSearch:
    """The search of one view, prepared for its side, ball size and image size by `prepare_search`.

    Attributes
    ----------
    parameters
        Parameters of the search.
    reduction
        Whole factor by which images are reduced before the search.
    ball_px
        Nominal width and height of a ball in the reduced image, px.
    field
        Parameters of the surgical field in the reduced image.
    trees
        Template tree of each comparison, scaled to the ball sizes.
    """

    parameters: DetectionParameters
    reduction: int
    ball_px: tuple[float, float]
    field: FieldParameters
    trees: tuple[TemplateTree, ...]

    def detect(self, frame: Frame) -> Detection:
        """Return the ball features of an image.

        Parameters
        ----------
        frame
            Image of the view that the search is prepared for.

        Returns
        -------
        Detection
            Features, best first, with the field that was searched.

        Raises
        ------
        ImageError
            When the image is not a gray image of 8 or 16 bits.
        """
        p, factor = self.parameters, self.reduction
        gray = frame.gray()
        whole = SurgicalField(0, 0, gray.shape[1], gray.shape[0])
        stored = gray
        gray, exposure = correct_exposure(stored, p.exposure)
        if exposure is Exposure.BLANK:
            return Detection(Features.empty(), whole, exposure, (Flag("blank-image", "the image is blank"),))
        maps = self._maps(gray, exposure)
        box = maps.field
        xy, score = self._segment(maps.feature_space)
        xy = (xy + np.array([box.u0, box.v0])) * factor + (factor - 1) / 2
        box = SurgicalField(*(factor * edge for edge in (box.u0, box.v0, box.u1, box.v1)))
        flags: tuple[Flag, ...] = (
            () if len(xy) else (Flag("no-features", "nothing in the image resembles a ball"),)
        )
        quality = assess_image(stored, p.quality)
        flags += image_flags(frame, exposure, quality)
        return Detection(self._features(xy, score), box, exposure, flags, quality)

    def maps(self, frame: Frame) -> CandidateMaps | None:
        """Return what an image becomes on the way to its features.

        Parameters
        ----------
        frame
            Image of the view that the search is prepared for.

        Returns
        -------
        CandidateMaps or None
            The maps; None for a blank image.
        """
        gray, exposure = correct_exposure(frame.gray(), self.parameters.exposure)
        return None if exposure is Exposure.BLANK else self._maps(gray, exposure)

    def _maps(self, gray: Single, exposure: Exposure) -> CandidateMaps:
        """Return the maps of an image (H, W) whose exposure is corrected."""
        p = self.parameters
        small = reduce_image(gray, self.reduction)
        blur_px = p.dark_blur_px if exposure is Exposure.VERY_DARK else 0.0
        tone = log_tone(small, p.log_offset, blur_px)
        gradient = property_planes(tone, PropertySpace.DIRECTIVITY)
        activity = np.abs(gradient[0])
        activity += np.abs(gradient[1])
        box = surgical_field(activity, self.field)
        crop = np.s_[..., box.v0 : box.v1, box.u0 : box.u1]
        return CandidateMaps(tone, activity, box, self._feature_space(small[crop], gradient[crop]))

    def _feature_space(self, gray: Single, gradient: Single) -> Floating:
        """Return the feature space (H, W) of gray levels (H, W) and the gradient (2, H, W) of their logarithm."""
        comparisons = self.parameters.comparisons
        decisions = []
        for c, tree in zip(comparisons, self.trees, strict=True):
            planes = gradient if c.space is PropertySpace.DIRECTIVITY else property_planes(gray, c.space)
            decisions.append(decision_space(planes, tree, c.measure, None))
        return feature_space(decisions, [c.weight for c in comparisons])

    def _segment(self, space: Floating) -> tuple[Floating, Floating]:
        """Return positions (n, 2), px, and scores (n,) of the features of a feature space (H, W)."""
        p = self.parameters
        radius_px = max(1, round(min(self.ball_px) * p.peak_radius))
        return peaks(space, p.max_features, radius_px, p.min_score)

    def _features(self, xy: Floating, score: Floating) -> Features:
        covariance = np.diag(np.square(self.parameters.sigma_px)) * self.reduction**2
        return Features(xy.astype(np.float64), score.astype(np.float64), np.tile(covariance, (len(xy), 1, 1)))


def prepare_search(
    side: Side,
    ball_px: tuple[float, float],
    image_size_px: tuple[int, ...],
    parameters: DetectionParameters,
    templates: TemplateSet | None = None,
) -> CandidateSearch:
    """Return the search of one view, with what does not depend on the image computed in advance.

    Large images are reduced by a whole factor, so that a ball is about as large as in the templates.

    Parameters
    ----------
    side
        Camera whose images are searched.
    ball_px
        Nominal width and height of a ball, px.
    image_size_px
        Width and height of the images, px.
    parameters
        Parameters of the search.
    templates
        Template set; None for the one that ships.

    Returns
    -------
    CandidateSearch
        The prepared search.
    """
    templates = templates or default_template_set()
    reduction = round(min(b / t for b, t in zip(ball_px, templates.diameter_px, strict=True)))
    reduction = max(1, min(reduction, *image_size_px))
    ball = (ball_px[0] / reduction, ball_px[1] / reduction)
    across, down = (b / t for b, t in zip(ball, templates.diameter_px, strict=True))
    sizes = [(across * scale, down * scale) for scale in parameters.scales]
    segment_px = max(1, round(parameters.field.segment_px * max(across, down)))
    return CandidateSearch(
        parameters,
        reduction,
        ball,
        replace(parameters.field, segment_px=segment_px),
        tuple(templates.trees[side, c.space].scaled(sizes) for c in parameters.comparisons),
    )


def detect(
    frame: Frame,
    ball_px: tuple[float, float],
    parameters: DetectionParameters,
    templates: TemplateSet | None = None,
) -> Detection:
    """Return the ball features of one image; `prepare_search` for several images of one view.

    Parameters
    ----------
    frame
        The image.
    ball_px
        Nominal width and height of a ball, px.
    parameters
        Parameters of the search.
    templates
        Template set; None for the one that ships.

    Returns
    -------
    Detection
        Features, best first, with the field that was searched.

    Raises
    ------
    ImageError
        When the image is not a gray image of 8 or 16 bits.

    References
    ----------
    Thesis chapter 4 and appendix C. By default gradient vectors of the log image are compared with the root only, and
    features are local maxima; `spinewatch.thesis_1995.detect_point` is the published method.

    Examples
    --------
    >>> frame = Frame(np.full((40, 50), 120, np.uint8), "left")
    >>> detect(frame, (9.1, 10.8), DetectionParameters()).flags
    (Flag(code='blank-image', detail='the image is blank'),)
    """
    return prepare_search(frame.side, ball_px, frame.pixels.shape, parameters, templates).detect(frame)


def image_flags(frame: Frame, exposure: Exposure, quality: ImageQuality) -> tuple[Flag, ...]:
    """Return the flags of an image that do not depend on its features.

    Parameters
    ----------
    frame
        The image.
    exposure
        Its kind of exposure.
    quality
        Its quality.

    Returns
    -------
    tuple of Flag
        "image-saturated", "image-dark", "pixel-defect", and those of the quality.
    """
    return _exposure_flags(exposure) + _defect_flags(frame) + quality.flags


def _exposure_flags(exposure: Exposure) -> tuple[Flag, ...]:
    """Return the flags of an image's kind of exposure."""
    if exposure is Exposure.GLARE:
        return (
            Flag("image-saturated", "much of the image is saturated; close the aperture or dim the lamp"),
        )
    if exposure is Exposure.VERY_DARK:
        return (Flag("image-dark", "the image is very dark; open the aperture or brighten the lamp"),)
    return ()


def _defect_flags(frame: Frame) -> tuple[Flag, ...]:
    """Return the flag of defective pixels."""
    defects = defective_pixels(frame.pixels)
    if not len(defects):
        return ()
    detail = (
        f"{len(defects)} lone pixels lie above the bit depth of all others, the first at u = {defects[0, 0]},"
        f" v = {defects[0, 1]}; correct the defects of the sensor in the camera"
    )
    return (Flag("pixel-defect", detail),)
