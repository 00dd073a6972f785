"""DETECT-POINT: detection of balls as published (thesis chapter 4, appendix C)."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from spinewatch.arrays import Float, Floating
from spinewatch.detection.candidates.decision_space import decision_space, feature_space
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.features import Features
from spinewatch.imaging.frame import Frame
from spinewatch.thesis_1995.preprocessing import Preprocessed, PreprocessingParameters, preprocess
from spinewatch.thesis_1995.template_trees import PublishedTrees, default_trees

_LEVELS = 256


@dataclass(frozen=True)
class DetectPointParameters:
    """Parameters of `detect_point`.

    Attributes
    ----------
    preprocessing
        Gamma corrections and size reduction.
    edge_weight
        Weight K of the edges in the feature space; gray levels have 1 (eq. 4.19).
    root_threshold
        Similarity of the root, in [0, 1], below which no representative is compared (eq. 4.18). The thesis gives no
        value. None compares with the root only, the relaxed mode of section 7.2.
    expected_features
        Number of features that are expected in an image.
    pixels_per_feature
        Pixels of the feature space that each expected feature may have.
    sigma_balls
        Standard deviation of a feature's position, as a fraction of the width and of the height of a ball: 0.50 and
        0.43 px with balls of 9.1 and 10.7 px. Measured on rendered images (``python -m bench.thesis --part
        uncertainty``); Table 4.4 has 0.71 and 0.64 px from centres that were digitized to whole pixels.
    """

    preprocessing: PreprocessingParameters = field(default_factory=PreprocessingParameters)
    edge_weight: float = 2.0
    root_threshold: float | None = 0.5
    expected_features: int = 15
    pixels_per_feature: int = 6
    sigma_balls: tuple[float, float] = (0.055, 0.040)


@dataclass(frozen=True, eq=False)
class DetectPoint:
    """What DETECT-POINT computes from one image, step by step.

    Attributes
    ----------
    preprocessed
        The surgical field in both property spaces (the files pre and edge).
    gray_decision, edge_decision
        Decision spaces, in [0, 1], shape (h, W) (crossGl and crossEd).
    feature_space
        Their weighted mean, in [0, 1], shape (h, W).
    feature_pixels
        The feature space at feature pixels, elsewhere 0, shape (h, W) (final).
    features
        Centroids of the components of feature pixels, in pixels of the whole image, best first.
    """

    preprocessed: Preprocessed
    gray_decision: Floating
    edge_decision: Floating
    feature_space: Floating
    feature_pixels: Floating
    features: Features


def detect_point(
    frame: Frame,
    ball_px: tuple[float, float],
    parameters: DetectPointParameters,
    trees: PublishedTrees | None = None,
) -> DetectPoint:
    """Return the ball features of one image by the published method.

    Parameters
    ----------
    frame
        The image.
    ball_px
        Width and height of a ball, px.
    parameters
        Parameters of the method.
    trees
        Template trees; None for those that ship.

    Returns
    -------
    DetectPoint
        Features with the images that they come from.

    Raises
    ------
    ImageError
        When the image is not a gray image of 8 or 16 bits.

    References
    ----------
    Thesis chapter 4: gray levels are compared by RHO, edges by CCM. Departure: templates are resampled to the size of
    the balls, which the thesis had constant.
    """
    image = preprocess(frame.gray(), parameters.preprocessing)
    scaled = (trees or default_trees()).scaled(ball_px).trees
    threshold = parameters.root_threshold
    gray = decision_space(image.gray[None], scaled[PropertySpace.GRAY], Measure.RHO, threshold)
    edge = decision_space(image.edges[None], scaled[PropertySpace.EDGE], Measure.CCM, threshold)
    space = feature_space([gray, edge], [1.0, parameters.edge_weight])
    pixels = feature_pixels(space, parameters.expected_features * parameters.pixels_per_feature)
    xy_px, score = component_centroids(pixels)
    xy_px[:, 1] += image.rows[0]
    covariance = np.tile(np.diag(np.square(parameters.sigma_balls) * np.square(ball_px)), (len(xy_px), 1, 1))
    return DetectPoint(image, gray, edge, space, pixels, Features(xy_px, score, covariance))


def feature_pixels(space: Floating, max_pixels: int) -> Floating:
    """Return a feature space in which only the best pixels are kept, by the histogram of its 256 levels.

    Parameters
    ----------
    space
        Feature space, in [0, 1], shape (H, W).
    max_pixels
        Number of pixels below which the histogram is accumulated from its upper end.

    Returns
    -------
    Floating
        The feature space at feature pixels, elsewhere 0, shape (H, W).

    References
    ----------
    Thesis eq. 4.20. A level that exceeds the number is left out as a whole, but the highest level of the image is kept.

    Examples
    --------
    >>> feature_pixels(np.array([[0.0, 0.5, 0.9], [0.5, 0.8, 0.5]]), 3)
    array([[0. , 0. , 0.9],
           [0. , 0.8, 0. ]])
    """
    level = np.rint(np.asarray(space) * (_LEVELS - 1)).astype(int)
    from_above = np.bincount(level.ravel(), minlength=_LEVELS)[::-1].cumsum()[::-1]
    admitted = np.flatnonzero(from_above <= max_pixels)
    lowest = max(1, min(int(admitted[0]) if len(admitted) else _LEVELS, int(level.max())))
    return np.where(level >= lowest, space, 0)


def component_centroids(pixels: Floating) -> tuple[Float, Float]:
    """Return the centroids of the 8-connected components of pixels that are not zero, best first.

    Parameters
    ----------
    pixels
        Feature pixels, shape (H, W).

    Returns
    -------
    xy_px : Float
        Centroids (u, v) weighted by value, shape (n, 2), px.
    score : Float
        Greatest value of each component, shape (n,).

    References
    ----------
    Thesis eq. 4.21 and 4.22.

    Examples
    --------
    >>> pixels = np.zeros((4, 6), np.float32)
    >>> pixels[1, 1:3], pixels[3, 5] = (0.6, 0.2), 0.4
    >>> component_centroids(pixels)[0].round(3)
    array([[1.25, 1.  ],
           [5.  , 3.  ]])
    """
    count, labels = cv2.connectedComponents((pixels > 0).astype(np.uint8), connectivity=8)
    if count <= 1:
        return np.empty((0, 2)), np.empty(0)
    v, u = np.nonzero(pixels > 0)
    component = np.asarray(labels[v, u] - 1, dtype=np.intp)
    weight = np.asarray(pixels[v, u], dtype=np.float64)
    total = np.bincount(component, weight)
    xy_px = np.stack([np.bincount(component, weight * axis) / total for axis in (u, v)], axis=1)
    score = np.zeros(count - 1)
    np.maximum.at(score, component, weight)
    order = np.argsort(-score, kind="stable")
    return xy_px[order], score[order]
