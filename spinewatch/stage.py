"""One stage of a surgery: what is known before its images are measured, and what was measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from spinewatch.detection.candidates.search import Detection
from spinewatch.errors import ParameterError, SameImageError
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.levels import vertebra_names
from spinewatch.marker_texts import require_possible
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.exclusion import RemovedTriad
from spinewatch.matching.rig_check import RigCheck
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.parameters import MethodParameters
from spinewatch.triads.explanation import Explanation
from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.labels import LabelledTriad, label_triads

LABELS_UNCERTAIN = "labels-uncertain"
"""Code of the flag of triads whose labels are not certain."""

SAME_IMAGE = "left and right are the same image; send the pair that the two cameras took"
"""Detail of `SameImageError`."""


@dataclass(frozen=True)
class StageRequest:
    """What is known of a stage before its images are measured.

    Attributes
    ----------
    labels
        Marked vertebrae in order of increasing coordinate along the spine axis, in any spelling that
        `levels.vertebra_names` accepts.
    spine_axis
        Object-space axis along which the spine lies; "auto" for the axis of greatest extent.
    triads
        Number of triads placed; None takes the number of labels, or leaves it unknown without labels.
    models
        Markers in use.
    known
        Earlier stage, distances or kinds of markers, which decide on labels when triads are missing.
    extra_levels
        Vertebrae that this spine has in addition to C1-C7, T1-T12, L1-L5 and S1, for example T13 or L6.
    removed
        Triads that a person removed, which are not found again.
    """

    labels: tuple[str, ...] = ()
    spine_axis: SpineAxis = "auto"
    triads: int | None = None
    models: tuple[TriadModel, ...] = (FLAT_10_14_18,)
    known: KnownConfiguration | None = None
    extra_levels: tuple[str, ...] = ()
    removed: tuple[RemovedTriad, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", vertebra_names(self.labels, self.extra_levels))
        require_possible(self.models)
        if self.triads is not None and self.triads < 1:
            raise ParameterError("the number of triads must be at least 1")
        if self.labels and self.triads not in (None, len(self.labels)):
            raise ParameterError(f"{self.triads} triads cannot carry {len(self.labels)} labels")

    @property
    def expected(self) -> int | None:
        """Number of triads placed, or None."""
        return self.triads if self.triads is not None else len(self.labels) or None


@dataclass(frozen=True, eq=False)
class StageMeasurement:
    """Result of one stereo pair.

    Attributes
    ----------
    left, right
        Features of each view, with the surgical field and the exposure.
    triads
        Triads in label order, unlabelled ones last.
    flags
        Flags of all steps.
    rig_check
        Check of the rig by the triads' balls; None with too few balls.
    parameters
        Parameters of the measurement.
    templates_version
        Version of the template set of the measurement.
    explanation
        What was considered and rejected; None unless it was asked for.
    """

    left: Detection
    right: Detection
    triads: tuple[LabelledTriad, ...]
    flags: tuple[Flag, ...]
    rig_check: RigCheck | None
    parameters: MethodParameters
    templates_version: str
    explanation: Explanation | None = None


def flags_of_views(detections: tuple[Detection, Detection]) -> list[Flag]:
    """Return the flags of both images, each with the side of its image.

    Parameters
    ----------
    detections
        Of the left and the right image.

    Returns
    -------
    list of Flag
        The flags, those of the left image first.
    """
    return [
        Flag(flag.code, f"{side}: {flag.detail}")
        for side, detection in zip(SIDES, detections, strict=True)
        for flag in detection.flags
    ]


def require_two_images(left: Frame, right: Frame) -> None:
    """Raise an error if two images are the same.

    Parameters
    ----------
    left, right
        Images of the two cameras.

    Raises
    ------
    SameImageError
        If all pixels are equal.
    """
    if np.array_equal(left.pixels, right.pixels):
        raise SameImageError(SAME_IMAGE)


def relabelled(measurement: StageMeasurement, request: StageRequest) -> StageMeasurement:
    """Return a measurement whose uncertain labels are decided again, with more knowledge.

    Parameters
    ----------
    measurement
        A measurement with the flag "labels-uncertain".
    request
        The request of the measurement, with the known configuration.

    Returns
    -------
    StageMeasurement
        The same triads with their labels; all other flags stay.
    """
    labelled, flags = label_triads(
        [triad.triad for triad in measurement.triads],
        request.labels,
        request.spine_axis,
        measurement.parameters.labels,
        request.known,
        request.extra_levels,
    )
    kept = tuple(flag for flag in measurement.flags if flag.code != LABELS_UNCERTAIN)
    return replace(measurement, triads=labelled, flags=(*kept, *flags))
