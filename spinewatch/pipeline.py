"""One stage of a surgery: from a stereo pair and its rig to labelled triads."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from spinewatch.arrays import Pixels
from spinewatch.camera import Camera, Rig
from spinewatch.detection.candidates.search import Detection, DetectionParameters, detect
from spinewatch.detection.candidates.templates import Side, TemplateSet, default_template_set
from spinewatch.detection.refinement.centres import (
    CandidateView,
    CentreParameters,
    Ranking,
    rank_features,
    settle_centres,
)
from spinewatch.detection.refinement.lamp import expected_lamp
from spinewatch.errors import ImageSizeError, ParameterError, SameImageError
from spinewatch.flags import Flag
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.epipolar import range_limits_mm
from spinewatch.matching.rig_check import RigCheck, RigCheckParameters
from spinewatch.matching.selection import SpineAxis
from spinewatch.parallel import both
from spinewatch.progress import Progress, silent
from spinewatch.triads.checked_search import check_search
from spinewatch.triads.labels import KnownConfiguration, LabelledTriad, LabelParameters, label_triads
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads

SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Parameters:
    """Parameters of all steps; stored with every result.

    ``ball_diameter_mm`` of a marker's ball.
    """

    ball_diameter_mm: float = 8.0
    detection: DetectionParameters = field(default_factory=DetectionParameters)
    centres: CentreParameters = field(default_factory=CentreParameters)
    search: SearchParameters = field(default_factory=SearchParameters)
    labels: LabelParameters = field(default_factory=LabelParameters)
    rig_check: RigCheckParameters = field(default_factory=RigCheckParameters)


@dataclass(frozen=True)
class StageRequest:
    """What the surgeon knows: vertebrae in order of increasing coordinate along ``spine_axis``, and how many triads.

    Without ``triads`` their number is that of the labels, or unknown when there are none. ``models`` are the
    markers in use; ``known``, an earlier stage, distances or kinds of markers, decides on labels when triads
    are missing.
    """

    labels: tuple[str, ...] = ()
    spine_axis: SpineAxis = "auto"
    triads: int | None = None
    models: tuple[TriadModel, ...] = (FLAT_10_14_18,)
    known: KnownConfiguration | None = None

    @property
    def expected(self) -> int | None:
        """Number of triads placed, or None."""
        return self.triads if self.triads is not None else len(self.labels) or None


@dataclass(frozen=True, eq=False)
class StageMeasurement:
    """What one stereo pair shows: detections, triads in label order (unlabelled ones last), and all flags.

    ``rig_check`` is what the triads' balls say about the rig, None when they are too few.
    """

    left: Detection
    right: Detection
    triads: tuple[LabelledTriad, ...]
    flags: tuple[Flag, ...]
    rig_check: RigCheck | None = None


def measure_stage(
    left: Pixels,
    right: Pixels,
    rig: Rig,
    request: StageRequest,
    parameters: Parameters | None = None,
    progress: Progress = silent,
    templates: TemplateSet | None = None,
) -> StageMeasurement:
    """Return the labelled triads of a stereo pair of gray images (H, W), 8 or 16 bits.

    Raises ``ImageSizeError`` for images of another size than the rig's, ``SameImageError`` when both are the
    same, ``ParameterError`` for a request that contradicts itself or a rig whose axes do not meet in front of
    it.
    """
    parameters = parameters or Parameters()
    templates = templates or default_template_set()
    _check_request(request)
    for side, image, camera in (("left", left, rig.left), ("right", right, rig.right)):
        _check_size(side, image, camera)
    if left.shape == right.shape and np.array_equal(left, right):
        raise SameImageError("left and right are the same picture; send the pair that the two cameras took")

    def match(with_rig: Rig) -> TriadSearch:
        return match_triads(
            left_found.features,
            right_found.features,
            with_rig,
            parameters.search,
            expected=request.expected,
            axis=request.spine_axis,
            images=(left, right),
            models=request.models,
        )

    progress("detect", 0.0)
    left_found, right_found = find_balls((left, right), rig, parameters, templates)
    progress("match", 0.7)
    matched, rig_check, rig_flags = check_search(
        match, left_found.features, right_found.features, rig, parameters.rig_check
    )
    progress("label", 0.9)
    labelled, label_flags = label_triads(
        matched.triads, request.labels, request.spine_axis, parameters.labels, request.known
    )
    flags = (
        *_of_side("left", left_found.flags),
        *_of_side("right", right_found.flags),
        *matched.flags,
        *rig_flags,
        *label_flags,
    )
    return StageMeasurement(left_found, right_found, labelled, flags, rig_check)


def find_balls(
    images: tuple[Pixels, Pixels],
    rig: Rig,
    parameters: Parameters,
    templates: TemplateSet | None = None,
) -> tuple[Detection, Detection]:
    """Return what the left and the right image (H, W) show: features with centres, covariances and scores settled.

    Raises ``ImageError`` for images that are not gray of 8 or 16 bits, ``ParameterError`` for a rig whose axes do not
    meet in front of it.
    """
    sizes, ranges = nominal_ball_px(rig, parameters), nominal_ranges_mm(rig, parameters)

    def search(number: int) -> tuple[Detection, Ranking]:
        camera, ball_px = (rig.left, rig.right)[number], sizes[number]
        found = detect(images[number], SIDES[number], ball_px, parameters.detection, templates)
        lamp = expected_lamp(rig, camera, ranges[number])
        view = CandidateView(camera, images[number], found.features, ball_px, lamp)
        return found, rank_features(view, parameters.centres)

    (left, left_ranking), (right, right_ranking) = both(search, 0, 1)
    settled = settle_centres((left_ranking, right_ranking), parameters.centres)
    return replace(left, features=settled[0]), replace(right, features=settled[1])


def nominal_ball_px(rig: Rig, parameters: Parameters) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the (width, height) in pixels of a ball's image in each view, at the middle of the range limits."""
    left, right = nominal_ranges_mm(rig, parameters)
    size = parameters.ball_diameter_mm
    return rig.left.ball_diameter_px(size, left), rig.right.ball_diameter_px(size, right)


def nominal_ranges_mm(rig: Rig, parameters: Parameters) -> tuple[float, float]:
    """Return the middle of the range limits along the left and the right optical axis, mm."""
    left, right = range_limits_mm(rig, parameters.search.matcher.candidates)
    return float(left.mean()), float(right.mean())


def parameters_document(parameters: Parameters) -> dict[str, Any]:
    """Return the parameters as a tree of plain values, ready for JSON."""
    return asdict(parameters)


def _check_request(request: StageRequest) -> None:
    if len(set(request.labels)) != len(request.labels) or not all(request.labels):
        raise ParameterError("labels must be different, non-empty names")
    if request.triads is not None and request.triads < 1:
        raise ParameterError("the number of triads must be at least 1")
    if request.labels and request.triads not in (None, len(request.labels)):
        raise ParameterError(f"{request.triads} triads cannot carry {len(request.labels)} labels")


def _check_size(side: str, image: Pixels, camera: Camera) -> None:
    width, height = camera.image_size_px
    if image.shape != (height, width):
        shape = " x ".join(str(n) for n in reversed(image.shape))
        raise ImageSizeError(
            f"the {side} image is {shape} pixels, the rig was calibrated for {width} x {height}; "
            "send the image as the camera took it, or the rig of this camera"
        )


def _of_side(side: str, flags: tuple[Flag, ...]) -> tuple[Flag, ...]:
    return tuple(Flag(flag.code, f"{side}: {flag.detail}") for flag in flags)
