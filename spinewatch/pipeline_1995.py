"""Measurement of a stereo pair by the published method: DETECT-POINT and MATCH-POINT, with the result of a stage."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.detection.candidates.search import Detection, image_flags
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.detector import check_image_size, nominal_ball_px
from spinewatch.detection.features import HIDDEN
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.imaging.exposure import ExposureParameters, correct_exposure
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.quality import QualityParameters, assess_image
from spinewatch.matching.epipolar import nominal_ranges_mm
from spinewatch.matching.points import Points, parallax_log_odds
from spinewatch.matching.rig_check import RigCheckParameters
from spinewatch.matching.triad_candidates import MAX_BALLS, TriadCandidates
from spinewatch.parallel import both
from spinewatch.progress import Progress, silent
from spinewatch.stage import StageMeasurement, StageRequest, flags_of_views, require_two_images
from spinewatch.thesis_1995.candidate_sets import CandidateSetParameters
from spinewatch.thesis_1995.detect_point import DetectPoint, DetectPointParameters, detect_point
from spinewatch.thesis_1995.explanation import explain_matching
from spinewatch.thesis_1995.match_point import MatchPoint, MatchPointParameters, match_point
from spinewatch.thesis_1995.template_trees import PublishedTrees, default_trees
from spinewatch.triads.drift import search_and_check_rig
from spinewatch.triads.flags import triad_flags
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.labels import LabelledTriad, label_triads
from spinewatch.triads.pose_fit import PoseParameters, fit_poses
from spinewatch.triads.search import TriadSearch

METHOD = "thesis-1995"
"""Name of the method in parameters and explanations."""

_FEATURES_PER_TRIAD = 3.75
"""Features that are expected for each triad: 15 for the four of the thesis, whose images show false ones too."""


@dataclass(frozen=True)
class PublishedParameters:
    """Parameters of `PublishedMeasurer`; stored with every result.

    Attributes
    ----------
    method
        Name of the method.
    ball_diameter_mm
        Diameter of a marker's ball, mm.
    detection
        DETECT-POINT. The number of features expected follows from that of the triads, when it is known.
    sets
        Candidate sets of MATCH-POINT and their refinement.
    distance_tolerance_mm
        Largest difference of each distance from that of the marker, mm (eq. 5.16).
    pose
        Error model of the poses. The balls of a triad share an error of 0.15 px along u in an image, as measured on
        rendered images (``python -m bench.thesis --part uncertainty``).
    labels
        Checks of the labels; the labels themselves are those of the order along the spine.
    rig_check
        Check of the rig by the balls.
    """

    method: str = METHOD
    ball_diameter_mm: float = 8.0
    detection: DetectPointParameters = field(default_factory=DetectPointParameters)
    sets: CandidateSetParameters = field(default_factory=CandidateSetParameters)
    distance_tolerance_mm: float = MatchPointParameters().distance_tolerance_mm
    pose: PoseParameters = field(default_factory=lambda: PoseParameters(common_sd_mrad=0.2))
    labels: LabelParameters = field(default_factory=LabelParameters)
    rig_check: RigCheckParameters = field(default_factory=lambda: RigCheckParameters(common_sd_mrad=0.2))


@dataclass(frozen=True, eq=False)
class PublishedSteps:
    """What the published programs compute from a pair.

    Attributes
    ----------
    left, right
        DETECT-POINT of each image.
    matching
        MATCH-POINT.
    parameters
        Parameters as they ran, with the number of features that was expected.
    """

    left: DetectPoint
    right: DetectPoint
    matching: MatchPoint
    parameters: PublishedParameters


class PublishedMeasurer:
    """Measures the stereo pairs of one rig by the published method.

    The features are those of DETECT-POINT, and the triads those that pass the heuristics of MATCH-POINT. Of their balls
    the full pose is fitted, as by the default method: its deviations follow from those of the features.

    Parameters
    ----------
    rig
        The calibrated cameras.
    parameters
        Parameters of all steps; the published ones by default.
    trees
        Template trees; those that ship by default.
    pool
        Executor of at least one thread, in which the right view is detected; by default one view after the other.

    Raises
    ------
    ParameterError
        If the optical axes do not meet in front of the cameras and no range is given.

    References
    ----------
    Thesis chapters 4 and 5. Triads with a hidden ball are not found, and labels need all triads (H5).
    """

    def __init__(
        self,
        rig: Rig,
        parameters: PublishedParameters | None = None,
        trees: PublishedTrees | None = None,
        pool: Executor | None = None,
    ) -> None:
        self.rig = rig
        self.parameters = p = parameters or PublishedParameters()
        self._trees = trees or default_trees()
        self._ball_px = nominal_ball_px(rig, nominal_ranges_mm(rig, p.sets.epipolar), p.ball_diameter_mm)
        self._pool = pool

    def steps(
        self, left: Frame, right: Frame, request: StageRequest, progress: Progress = silent
    ) -> PublishedSteps:
        """Return what the published programs compute from a pair.

        Parameters
        ----------
        left, right
            Images of the two cameras.
        request
            Labels, spine axis and marker.
        progress
            Called at the start of each step: detect, match.

        Returns
        -------
        PublishedSteps
            Both programs, step by step.

        Raises
        ------
        ImageError
            If an image is not a gray image of 8 or 16 bits.
        ImageSizeError
            If an image has another size than its camera.
        ParameterError
            If there is more than one marker, or it has other balls than XX, YY and MX; if an earlier stage is given.
        """
        p = self.parameters
        if len(request.models) != 1:
            raise ParameterError(
                "the method of 1995 knows one kind of marker; name one, or use the default method"
            )
        if request.known is not None:
            raise ParameterError(
                "the method of 1995 labels by order alone; leave the earlier stage out, or use the default method"
            )
        matching = MatchPointParameters(p.sets, p.distance_tolerance_mm, request.models[0])
        for frame, camera in ((left, self.rig.left), (right, self.rig.right)):
            check_image_size(frame, camera)
        progress("detect", 0.0)
        if request.expected is not None:
            expected = round(_FEATURES_PER_TRIAD * request.expected)
            p = replace(p, detection=replace(p.detection, expected_features=expected))
        views = ((left, self._ball_px[0]), (right, self._ball_px[1]))
        found = both(lambda view: detect_point(*view, p.detection, self._trees), *views, self._pool)
        progress("match", 0.7)
        features = found[0].features, found[1].features
        images = (left.pixels, right.pixels)
        matched = match_point(
            *features, self.rig, request.labels, matching, axis=request.spine_axis, images=images
        )
        return PublishedSteps(*found, matched, p)

    def measure(
        self,
        left: Frame,
        right: Frame,
        request: StageRequest,
        progress: Progress = silent,
        *,
        explained: bool = False,
    ) -> StageMeasurement:
        """Return the labelled triads of a stereo pair.

        Parameters
        ----------
        left, right
            Images of the two cameras.
        request
            Labels, spine axis and marker.
        progress
            Called at the start of each step: detect, match, label.
        explained
            Whether the result tells what was considered and rejected.

        Returns
        -------
        StageMeasurement
            Features, triads, flags and the check of the rig, as the default method returns them.

        Raises
        ------
        ImageError
            If an image is not a gray image of 8 or 16 bits.
        ImageSizeError
            If an image has another size than its camera.
        SameImageError
            If both images are the same.
        ParameterError
            If the request names what the method does not know.
        """
        require_two_images(left, right)
        steps = self.steps(left, right, request, progress)
        detections = _detection(left, steps.left), _detection(right, steps.right)
        search = self._search(steps, request)
        features = detections[0].features, detections[1].features
        search, check, rig_flags = search_and_check_rig(
            lambda _: search,
            *features,
            self.rig,
            replace(
                steps.parameters.rig_check, refine=False
            ),  # the published triads are those of the given rig
            request.models,
        )
        progress("label", 0.9)
        triads, label_flags = _labelled(search, request, steps.parameters.labels)
        explanation = None
        if explained:
            explanation = explain_matching(steps.matching, features, search, request.models[0], METHOD)
        return StageMeasurement(
            *detections,
            triads,
            (*flags_of_views(detections), *search.flags, *rig_flags, *label_flags),
            check,
            steps.parameters,
            self._trees.version,
            explanation,
        )

    def _search(self, steps: PublishedSteps, request: StageRequest) -> TriadSearch:
        """Return the triads of MATCH-POINT with their fitted poses."""
        found, model, p = steps.matching, request.models[0], steps.parameters
        members = [triad.triplet for triad in found.triads]
        point = found.triplets[members]
        origin, rotation = approximate_poses(model.coordinates_mm, found.points.position_mm[point])
        left, right = (np.full((len(members), MAX_BALLS), HIDDEN, dtype=np.intp) for _ in range(2))
        left[:, : point.shape[1]], right[:, : point.shape[1]] = found.left[point], found.right[point]
        none = np.zeros(len(members))
        selected = TriadCandidates(none.astype(np.intp), origin, rotation, none, left, right)
        features = steps.left.features, steps.right.features
        triads = fit_poses(*features, self.rig, selected, request.models, p.pose)
        return TriadSearch(triads, selected, self._points(steps), (), triad_flags(triads, request.expected))

    def _points(self, steps: PublishedSteps) -> Points:
        """Return the reconstructed points; the published method gives them no odds, these are of their parallax."""
        found, p = steps.matching, steps.parameters
        plate_sd_mm = [
            np.multiply(np.multiply(p.detection.sigma_balls, ball_px), camera.pixel_size_mm)
            for ball_px, camera in zip(self._ball_px, (self.rig.left, self.rig.right), strict=True)
        ]
        sd_mm = float(np.linalg.norm([np.sqrt(np.mean(np.square(sd))) for sd in plate_sd_mm]))
        scores = steps.left.features.score[found.left], steps.right.features.score[found.right]
        return Points(
            found.points.position_mm,
            found.points.covariance_mm2,
            found.left,
            found.right,
            found.points.parallax_mm,
            found.points.chi2,
            parallax_log_odds(found.points.chi2, p.sets.tolerance_mm / sd_mm),
            np.minimum(*scores),
        )


def _detection(frame: Frame, found: DetectPoint) -> Detection:
    """Return the features of an image with its exposure and quality; both gammas are applied at any exposure."""
    gray = frame.gray()
    _, exposure = correct_exposure(gray, ExposureParameters())
    quality = assess_image(gray, QualityParameters())
    first, last = found.preprocessed.rows
    flags = image_flags(frame, exposure, quality)
    if not len(found.features):
        flags = (Flag("no-features", "nothing in the image resembles a ball"), *flags)
    return Detection(found.features, SurgicalField(0, first, gray.shape[1], last), exposure, flags, quality)


def _labelled(
    search: TriadSearch, request: StageRequest, parameters: LabelParameters
) -> tuple[tuple[LabelledTriad, ...], tuple[Flag, ...]]:
    """Return triads labelled by their order along the spine when all were found (H5), else without labels."""
    if not request.labels or len(search.triads) == len(request.labels):
        return label_triads(
            search.triads,
            request.labels,
            request.spine_axis,
            parameters,
            extra_levels=request.extra_levels,
        )
    reason = (
        f"{len(search.triads)} triads passed the heuristics, and {len(request.labels)} were placed (H5); without all of"
        " them the method of 1995 gives no labels"
    )
    triads = tuple(LabelledTriad(None, reason, triad) for triad in search.triads)
    return triads, (Flag("labels-uncertain", reason),) if triads else ()
