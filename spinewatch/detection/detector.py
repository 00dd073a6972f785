"""The ball detector of a rig: candidates by templates, then centres by networks, in both views."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.candidates.search import (
    CandidateSearch,
    Detection,
    DetectionParameters,
    prepare_search,
)
from spinewatch.detection.candidates.templates import TemplateSet, default_template_set
from spinewatch.detection.features import Features
from spinewatch.detection.negative import is_negative
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.centres import refine
from spinewatch.detection.refinement.duplicates import same_ball
from spinewatch.detection.refinement.lamp import expected_lamp
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import BallNetworks
from spinewatch.detection.refinement.proposals import NominalView, Proposals, propose
from spinewatch.errors import ImageSizeError, ParameterError
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.imaging.quality import exposure_flags
from spinewatch.imaging.sharpness import edge_widths_px
from spinewatch.parallel import both

_UNKNOWN_SIMILARITY = 0.4
"""Template similarity of a place that geometry proposes, about that of the least candidates: the networks decide."""


@dataclass(frozen=True, eq=False)
class BallDetector:
    """Detector of the balls in the pairs of one rig, prepared once by `prepare_detector`.

    Attributes
    ----------
    views
        Camera, nominal ball size and expected lamp of the left and the right view.
    searches
        Candidate search of the left and the right view, with templates scaled to the ball size.
    centres
        Parameters of the centres.
    networks
        Networks that estimate the centres.
    template_version
        Version of the template set, to be stored with results.
    """

    views: tuple[NominalView, NominalView]
    searches: tuple[CandidateSearch, CandidateSearch]
    centres: CentreParameters
    networks: BallNetworks
    template_version: str

    def detect(self, left: Frame, right: Frame, pool: Executor | None = None) -> tuple[Detection, Detection]:
        """Return the balls of a pair: features with refined centres, covariances and scores.

        Parameters
        ----------
        left, right
            The two images.
        pool
            Executes the right view at the same time as the left one; None for one after the other.

        Returns
        -------
        tuple of Detection
            Left and right detection, most probable balls first.

        Raises
        ------
        ImageError
            For images that are not gray images of 8 or 16 bits.
        ImageSizeError
            For images of another size than the rig's.
        ParameterError
            When left and right are exchanged.
        """
        frames = (left, right)
        if (left.side, right.side) != SIDES:
            raise ParameterError("the frames are not a left and a right one; give the left frame first")
        for view, frame in zip(self.views, frames, strict=True):
            check_image_size(frame, view.camera)

        def propose_in(number: int) -> tuple[Detection, Proposals]:
            view, frame = self.views[number], frames[number]
            found = self.searches[number].detect(frame)
            return found, propose(view, frame, found.features, self.networks, self.centres)

        (left_found, left_proposals), (right_found, right_proposals) = both(propose_in, 0, 1, pool)
        refined = refine((left_proposals, right_proposals), self.centres, pool)
        exposure = exposure_flags(left.gray(), right.gray(), self.searches[0].parameters.quality)
        detections = [
            self._assessed(
                number,
                frames[number],
                replace(found, features=view.features, discarded=view.discarded),
                flags,
            )
            for number, (found, view, flags) in enumerate(
                zip((left_found, right_found), refined, exposure, strict=True)
            )
        ]
        return detections[0], detections[1]

    def look_again(
        self,
        frames: tuple[Frame, Frame],
        found: tuple[Detection, Detection],
        places: tuple[Float, Float],
        pool: Executor | None = None,
    ) -> tuple[Detection, Detection]:
        """Return detections with the balls at given places, which the candidate search did not propose.

        Parameters
        ----------
        frames
            The left and the right image.
        found
            Their detections.
        places
            Where balls may be in each image, (u, v), shape (n, 2), px; a ball is found half a radius from its place.
        pool
            Executes the right view at the same time as the left one; None for one after the other.

        Returns
        -------
        tuple of Detection
            The detections with those features at the places that are no less probable balls than the least of them.
            Features of the first look stay, except coarse estimates of the same balls, and the least probable ones
            beyond the largest number of features.
        """
        p = self.centres

        def propose_in(number: int) -> Proposals:
            known = found[number].features
            best = known.take(np.arange(min(p.n_shared, len(known))))
            candidates = Features(
                np.concatenate([best.xy_px, places[number]]),
                np.concatenate([best.score, np.full(len(places[number]), _UNKNOWN_SIMILARITY)]),
                np.zeros((len(best) + len(places[number]), 2, 2)),
            )
            return propose(self.views[number], frames[number], candidates, self.networks, p)

        proposals = both(propose_in, 0, 1, pool)
        count = max(map(len, places)) + p.n_shared
        least = min(detection.features.score.min(initial=1.0) for detection in found)
        all_places = replace(p, n_refined=count, n_rotated=count, n_kept=count)
        seen = refine(proposals, all_places, pool, any_look=True, min_score=float(least))
        detections = []
        for number, view in enumerate(seen):
            before = found[number]
            factor, extra_sd_px, _ = self._deviations(number, frames[number], before)
            new = view.features.enlarged(factor, extra_sd_px)
            features = _with_second_look(before.features, new, np.array(self.views[number].ball_px) / 2, p)
            discarded = before.discarded.beside(before.features, features)
            detections.append(replace(before, features=features, discarded=discarded))
        return detections[0], detections[1]

    def _assessed(self, number: int, frame: Frame, found: Detection, flags: tuple[Flag, ...]) -> Detection:
        """Return a detection with the flags of its image, its deviations enlarged as the image's quality requires."""
        factor, extra_sd_px, blurred = self._deviations(number, frame, found)
        flags = (*flags, *blurred)
        if is_negative(frame, found, self.views[number], self.searches[number], self.networks, self.centres):
            detail = "balls are found in the negative of the image only; export the image with black as zero"
            flags = (*flags, Flag("image-negative", detail))
        features = found.features.enlarged(factor, extra_sd_px)
        return replace(found, features=features, flags=(*found.flags, *flags))

    def _deviations(
        self, number: int, frame: Frame, found: Detection
    ) -> tuple[Float, tuple[float, float], tuple[Flag, ...]]:
        """Return the factors and the further deviations (2,), px, that an image requires, and the flag of its blur."""
        factor = np.full(2, found.quality.sd_factor)
        sharpness, ball_px = self.searches[number].parameters.sharpness, self.views[number].ball_px
        widths = edge_widths_px(frame.pixels, found.features.xy_px, ball_px, sharpness)
        flags: tuple[Flag, ...] = ()
        if widths is not None:
            limits = np.maximum(sharpness.max_width_px, sharpness.max_width * np.array(ball_px))
            relative = np.array(widths) / limits
            if relative.max() > 1:
                factor *= np.maximum(relative, 1) ** sharpness.sd_exponent
                detail = (
                    f"edges at the balls are {widths[0]:.1f} px wide along u and {widths[1]:.1f} px along v (at most"
                    f" {limits[0]:.1f} and {limits[1]:.1f} px); focus the"
                    " camera, expose for a shorter time"
                )
                flags = (Flag("image-blurred", detail),)
        return factor, found.quality.extra_sd_px, flags


def _with_second_look(first: Features, second: Features, radius_px: Float, p: CentreParameters) -> Features:
    """Return the features of the first look with those of the second that are other balls or better estimates."""
    probable = second.score >= first.score.min(initial=1.0)
    new = second.take(np.flatnonzero(probable))
    same = same_ball(first.xy_px, new.xy_px, radius_px, p.merge_radius)
    refined = np.arange(len(first)) < p.n_refined
    added = ~same[refined].any(axis=0)
    new, same = new.take(np.flatnonzero(added)), same[:, added]
    kept = first.take(np.flatnonzero(refined | ~same.any(axis=1)))
    # what takes the place of a feature is the better estimate of a ball that is no less probable
    replaced = np.where(same, first.score[:, None], 0).max(axis=0, initial=0)
    joined = kept.with_others(replace(new, score=np.maximum(new.score, replaced)))
    return joined.take(np.arange(min(p.n_kept, len(joined))))


def prepare_detector(
    rig: Rig,
    ranges_mm: tuple[float, float],
    ball_diameter_mm: float,
    detection: DetectionParameters,
    centres: CentreParameters,
    templates: TemplateSet | None = None,
    networks: BallNetworks | None = None,
) -> BallDetector:
    """Return the detector of a rig, with what depends on rig and parameters only computed in advance.

    Parameters
    ----------
    rig
        The rig.
    ranges_mm
        Nominal range of the balls along the left and the right optical axis, mm.
    ball_diameter_mm
        Diameter of a ball, mm.
    detection
        Parameters of the candidate search.
    centres
        Parameters of the centres.
    templates
        Template set; None for the one that ships.
    networks
        Networks; None for those that ship.

    Returns
    -------
    BallDetector
        The prepared detector.

    Examples
    --------
    >>> camera = Camera((-150, 0, 700), (0, 12, 0), 9.0, (0, 0), (0, 0), (0, 0), (568, 416), (0.01, 0.00845))
    >>> other = replace(camera, position_mm=(150, 0, 700), rotation_deg=(0, -12, 0))
    >>> detector = prepare_detector(
    ...     Rig("cart", camera, other), (715.0, 715.0), 8.0, DetectionParameters(), CentreParameters()
    ... )
    >>> [round(size, 1) for size in detector.views[0].ball_px]
    [10.1, 11.9]
    """
    templates = templates or default_template_set()
    sizes = nominal_ball_px(rig, ranges_mm, ball_diameter_mm)
    cameras = (rig.left, rig.right)
    views = [
        NominalView(camera, ball_px, expected_lamp(rig, camera, range_mm))
        for camera, ball_px, range_mm in zip(cameras, sizes, ranges_mm, strict=True)
    ]
    searches = [
        prepare_search(side, ball_px, camera.image_size_px, detection, templates)
        for side, camera, ball_px in zip(SIDES, cameras, sizes, strict=True)
    ]
    return BallDetector(
        (views[0], views[1]),
        (searches[0], searches[1]),
        centres,
        networks or default_networks(),
        templates.version,
    )


def nominal_ball_px(
    rig: Rig, ranges_mm: tuple[float, float], ball_diameter_mm: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the nominal size of balls in both views.

    Parameters
    ----------
    rig
        The rig.
    ranges_mm
        Nominal range of the balls along the left and the right optical axis, mm.
    ball_diameter_mm
        Diameter of a ball, mm.

    Returns
    -------
    tuple
        Width and height in the left image, and in the right one, px.
    """
    left, right = ranges_mm
    return (
        rig.left.ball_diameter_px(ball_diameter_mm, left),
        rig.right.ball_diameter_px(ball_diameter_mm, right),
    )


def check_image_size(frame: Frame, camera: Camera) -> None:
    """Check that an image has the size that its camera was calibrated for.

    Parameters
    ----------
    frame
        The image.
    camera
        Its camera.

    Raises
    ------
    ImageSizeError
        When the sizes differ.
    """
    width, height = camera.image_size_px
    if frame.pixels.shape != (height, width):
        shape = " x ".join(str(n) for n in reversed(frame.pixels.shape))
        raise ImageSizeError(
            f"the {frame.side} image is {shape} pixels, the rig was calibrated for {width} x {height}; "
            "send the image as the camera took it, or the rig of this camera"
        )
