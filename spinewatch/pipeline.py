"""One stage of a surgery: from a stereo pair and its rig to labelled triads."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from math import sqrt

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.candidates.search import CandidateMaps, Detection
from spinewatch.detection.candidates.templates import TemplateSet
from spinewatch.detection.detector import prepare_detector
from spinewatch.detection.features import Features
from spinewatch.detection.manual import CentreEdit, edit_features
from spinewatch.detection.placed_centres import like_balls
from spinewatch.errors import SameImageError
from spinewatch.flags import Flag
from spinewatch.imaging.comparison import compare_images
from spinewatch.imaging.frame import Frame
from spinewatch.matching.epipolar import nominal_ranges_mm
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.parameters import Parameters
from spinewatch.progress import Progress, silent
from spinewatch.stage import SAME_IMAGE, StageMeasurement, StageRequest, flags_of_views, require_two_images
from spinewatch.triads.diagnosis import diagnose
from spinewatch.triads.doubt import without_doubtful_poses, without_unsupported_poses
from spinewatch.triads.drift import search_and_check_rig
from spinewatch.triads.explanation import Explanation, explain
from spinewatch.triads.flags import TRIAD_FLAGS, triad_flags
from spinewatch.triads.labels import label_triads
from spinewatch.triads.marker_check import marker_flags
from spinewatch.triads.placed_centres import compare_placed_centres
from spinewatch.triads.pose_fit import fit_poses
from spinewatch.triads.search import TriadSearch, match_triads
from spinewatch.triads.second_look import missing_ball_places
from spinewatch.triads.unused_centres import unused_centre_flags
from spinewatch.triads.variance_factor import variance_factor, variance_flags


def _pose_count(search: TriadSearch) -> int:
    return sum(triad.pose is not None for triad in search.triads)


def _without_unsupported_poses(search: TriadSearch, request: StageRequest) -> TriadSearch:
    """Return a search none of whose triads has a pose if most are doubtful, with the flags of its triads."""
    triads = without_unsupported_poses(search.triads)
    others = (flag for flag in search.flags if flag.code not in TRIAD_FLAGS)
    return replace(search, triads=triads, flags=(*triad_flags(triads, request.expected), *others))


class StageMeasurer:
    """Measures the stereo pairs of one rig.

    Templates, networks and ball sizes are prepared once; `measure` may then be called for any number of pairs.

    Parameters
    ----------
    rig
        The calibrated cameras.
    parameters
        Parameters of all steps; the defaults by default.
    templates
        Template set of the detector; the set that ships with the library by default.
    pool
        Executor of at least one thread, in which the right view is detected while the calling thread detects the left
        one; by default one view after the other.

    Raises
    ------
    ParameterError
        If the optical axes do not meet in front of the cameras and no range is given.

    Notes
    -----
    The matrices are small: further threads of the linear algebra library only slow the measurement down, on a busy
    machine several times over. Set ``OPENBLAS_NUM_THREADS=1`` before NumPy is imported, as the ``spinewatch`` command
    does.
    """

    def __init__(
        self,
        rig: Rig,
        parameters: Parameters | None = None,
        templates: TemplateSet | None = None,
        pool: Executor | None = None,
    ) -> None:
        self.rig = rig
        self.parameters = p = parameters or Parameters()
        self._ranges_mm = nominal_ranges_mm(rig, p.search.matching.epipolar)
        self._detector = prepare_detector(
            rig,
            self._ranges_mm,
            p.ball_diameter_mm,
            p.detection,
            p.centres,
            templates,
        )
        self._pool = pool

    def detect(self, left: Frame, right: Frame) -> tuple[Detection, Detection]:
        """Return the features of both views, the first step of `measure`.

        Parameters
        ----------
        left, right
            Images of the two cameras.

        Returns
        -------
        tuple of Detection
            Features of the left and the right view, most probable balls first.

        Raises
        ------
        ImageError
            If an image is not a gray image of 8 or 16 bits.
        ImageSizeError
            If an image has another size than its camera.
        """
        return self._detector.detect(left, right, self._pool)

    def maps(self, left: Frame, right: Frame) -> tuple[CandidateMaps | None, CandidateMaps | None]:
        """Return what both images become on the way to their features.

        Parameters
        ----------
        left, right
            Images of the two cameras.

        Returns
        -------
        tuple of CandidateMaps or None
            Maps of the left and the right image; None for a blank one.
        """
        searches = self._detector.searches
        return searches[0].maps(left), searches[1].maps(right)

    def edit(
        self,
        detections: tuple[Detection, Detection],
        features: tuple[Features, Features],
        edits: tuple[Sequence[CentreEdit], Sequence[CentreEdit]],
    ) -> tuple[Detection, Detection]:
        """Return detections with the features that a person edited, between `detect` and `match`.

        Parameters
        ----------
        detections
            Detections of the left and the right view.
        features
            Features of both views that are edited, of an earlier measurement of the same images.
        edits
            Centres that are added, moved or removed in each view.

        Returns
        -------
        tuple of Detection
            Detections of the left and the right view.
        """
        centres = self.parameters.centres
        edited = []
        for found, before, changes, view in zip(
            detections, features, edits, self._detector.views, strict=True
        ):
            detected = before.with_others(found.features)
            after = edit_features(before, changes, view.ball_px, centres, detected)
            discarded = found.discarded.beside(found.features, after)
            likely = like_balls(detected, centres)
            edited.append(replace(found, features=after, discarded=discarded, detected=likely))
        return edited[0], edited[1]

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
            Labels, spine axis and markers.
        progress
            Called at the start of each step: detect, match, label.
        explained
            Whether the result tells what was considered and rejected.

        Returns
        -------
        StageMeasurement
            Features, triads, flags and the check of the rig.

        Raises
        ------
        ImageError
            If an image is not a gray image of 8 or 16 bits.
        ImageSizeError
            If an image has another size than its camera.
        SameImageError
            If both images are the same, or of the same exposure with other noise.
        """
        require_two_images(left, right)
        progress("detect", 0.0)
        frames, detections = (left, right), self.detect(left, right)
        progress("match", 0.7)
        search = self._match(detections, frames, request, self.rig)
        for _ in range(self.parameters.second_look.rounds):
            if (places := self._missing_balls(detections, search, request)) is None:
                break
            further = self._detector.look_again(frames, detections, places, self._pool)
            found = self._match(further, frames, request, self.rig)
            if _pose_count(found) < _pose_count(search):  # what it added are chance combinations
                break
            detections, search = further, found
        return self._measurement(
            detections, frames, search, request, progress, explained=explained, edited=False
        )

    def match(
        self,
        detections: tuple[Detection, Detection],
        frames: tuple[Frame, Frame],
        request: StageRequest,
        progress: Progress = silent,
        *,
        explained: bool = False,
    ) -> StageMeasurement:
        """Return the labelled triads that the features of a stereo pair show, the second step of `measure`.

        Parameters
        ----------
        detections
            Features of the left and the right view.
        frames
            Images of the two cameras.
        request
            Labels, spine axis and markers.
        progress
            Called at the start of each step: match, label.
        explained
            Whether the result tells what was considered and rejected.

        Returns
        -------
        StageMeasurement
            Features, triads, flags and the check of the rig.

        Raises
        ------
        SameImageError
            If both images are of the same exposure with other noise.
        """
        progress("match", 0.7)
        search = self._match(detections, frames, request, self.rig)
        return self._measurement(
            detections, frames, search, request, progress, explained=explained, edited=True
        )

    def _measurement(
        self,
        detections: tuple[Detection, Detection],
        frames: tuple[Frame, Frame],
        search: TriadSearch,
        request: StageRequest,
        progress: Progress,
        *,
        explained: bool,
        edited: bool,
    ) -> StageMeasurement:
        """Return the result of a pair, from the search for triads in its features, detected or edited."""
        search, rig_check, rig_flags = search_and_check_rig(
            lambda rig: search if rig is self.rig else self._match(detections, frames, request, rig),
            detections[0].features,
            detections[1].features,
            self.rig,
            self.parameters.rig_check,
            request.models,
        )
        # A camera that has moved explains large residuals; the deviations of edited features are enlarged already.
        if not edited and (rig_check is None or not rig_check.drifted):
            detections, search = self._with_variance_factor(detections, search, request)
        if not edited:
            search = _without_unsupported_poses(search, request)
        diagnosis_flags = self._diagnose(detections, frames, search, request)
        unused_flags = unused_centre_flags((detections[0].features, detections[1].features), search.triads)
        triads, placed_flags = compare_placed_centres(
            search.triads,
            (detections[0].detected, detections[1].detected),
            (self._detector.views[0].ball_px, self._detector.views[1].ball_px),
            self.parameters.centres,
        )
        progress("label", 0.9)
        labelled, label_flags = label_triads(
            triads,
            request.labels,
            request.spine_axis,
            self.parameters.labels,
            request.known,
            request.extra_levels,
        )
        of_triads = (*search.flags, *unused_flags, *placed_flags)
        flags = (*flags_of_views(detections), *of_triads, *rig_flags, *diagnosis_flags, *label_flags)
        explanation = self._explanation(detections, search, request) if explained else None
        return StageMeasurement(
            *detections,
            labelled,
            flags,
            rig_check,
            self.parameters,
            self._detector.template_version,
            explanation,
        )

    def _with_variance_factor(
        self,
        detections: tuple[Detection, Detection],
        search: TriadSearch,
        request: StageRequest,
    ) -> tuple[tuple[Detection, Detection], TriadSearch]:
        """Return detections and triads whose deviations are confirmed by the residuals of the triads."""
        p = self.parameters.variance_factor
        factor = variance_factor(search.triads, p)
        if not p.enabled or factor == 1:
            return detections, search
        left, right = (replace(found, features=found.features.enlarged(sqrt(factor))) for found in detections)
        triads = fit_poses(
            left.features,
            right.features,
            self.rig,
            search.selected,
            request.models,
            self.parameters.search.pose,
        )
        chances = [triad.chance_false for triad in search.triads]
        triads = without_doubtful_poses(triads, chances, self.parameters.search.doubt.max_chance)
        flags = (*triad_flags(triads, request.expected), *variance_flags(factor, p))
        return (left, right), replace(search, triads=triads, flags=flags)

    def _missing_balls(
        self, detections: tuple[Detection, Detection], search: TriadSearch, request: StageRequest
    ) -> tuple[Float, Float] | None:
        """Return the places in both images for a second look; None when no ball is missing."""
        left, right = (detection.features for detection in detections)
        p = self.parameters.second_look
        return missing_ball_places(
            search, left, right, self.rig, self._ranges_mm, request.models, p, request.expected
        )

    def _explanation(
        self, detections: tuple[Detection, Detection], search: TriadSearch, request: StageRequest
    ) -> Explanation:
        return explain(
            search,
            (detections[0].features, detections[1].features),
            self.rig,
            self.parameters.search,
            request.models,
            expected=request.expected,
            axis=request.spine_axis,
            removed=request.removed,
        )

    def _diagnose(
        self,
        detections: tuple[Detection, Detection],
        frames: tuple[Frame, Frame],
        search: TriadSearch,
        request: StageRequest,
    ) -> tuple[Flag, ...]:
        """Return flags with the cause if triads are missing, or none fits the markers in full view."""
        left, right = (detection.features for detection in detections)
        other_marker = marker_flags(
            search.triads,
            (left, right),
            self.rig,
            self.parameters.search,
            request.models,
            self.parameters.diagnosis,
            expected=request.expected,
            axis=request.spine_axis,
            misfit=any(flag.code == "appearance-unusual" for flag in search.flags),
        )
        found = _pose_count(search)
        if found and 2 * found >= (request.expected or 0):
            return other_marker
        if compare_images(
            frames[0].pixels, frames[1].pixels
        ).repeated:  # without parallax there are no triads
            raise SameImageError(SAME_IMAGE)
        expected = f" of {request.expected}" if request.expected else ""
        if other_marker:
            detail = f"{found}{expected} triads were found; {other_marker[0].detail}"
            return (Flag("no-triads", detail), *other_marker)
        if axis_flags := self._axis_flags(detections, frames, found, request):
            return axis_flags
        diagnosis = diagnose(
            left,
            right,
            self.rig,
            self.parameters.search,
            request.models,
            self.parameters.diagnosis,
            expected=request.expected,
            axis=request.spine_axis,
        )
        flag = Flag("no-triads", f"{found}{expected} triads were found; {diagnosis.detail}")
        return (flag, Flag("calibration-drift", diagnosis.detail)) if diagnosis.rig_has_moved else (flag,)

    def _axis_flags(
        self,
        detections: tuple[Detection, Detection],
        frames: tuple[Frame, Frame],
        found: int,
        request: StageRequest,
    ) -> tuple[Flag, ...]:
        """Return a flag if the triads lie along the other axis than the one that was given."""
        if request.spine_axis == "auto":
            return ()
        other: SpineAxis = "y" if request.spine_axis == "x" else "x"
        across = self._match(detections, frames, replace(request, spine_axis=other), self.rig)
        n_across = _pose_count(across)
        if n_across < max(found + 2, (request.expected or 0) / 2):
            return ()
        detail = (
            f"triads found along the spine axis {request.spine_axis}: {found}, along {other}: {n_across}; give the axis"
            " along which the spine lies"
        )
        return (Flag("spine-axis-implausible", detail),)

    def _match(
        self,
        detections: tuple[Detection, Detection],
        frames: tuple[Frame, Frame],
        request: StageRequest,
        rig: Rig,
    ) -> TriadSearch:
        return match_triads(
            detections[0].features,
            detections[1].features,
            rig,
            self.parameters.search,
            expected=request.expected,
            axis=request.spine_axis,
            images=(frames[0].pixels, frames[1].pixels),
            models=request.models,
            removed=request.removed,
        )
