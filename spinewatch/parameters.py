"""Parameters of all steps of the measurement of a stereo pair."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.matching.rig_check import RigCheckParameters
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.search import SearchParameters
from spinewatch.triads.second_look import SecondLookParameters
from spinewatch.triads.variance_factor import VarianceFactorParameters


@dataclass(frozen=True)
class Parameters:
    """Parameters of all steps; stored with every result.

    Attributes
    ----------
    ball_diameter_mm
        Diameter of a marker's ball, mm.
    detection
        Search for candidates by templates.
    centres
        Refinement of centres by networks.
    search
        From features to poses.
    second_look
        Places that are examined again when balls are missing.
    variance_factor
        Deviations of features by the residuals of the triads.
    labels
        Labels when triads are missing.
    rig_check
        Check of the rig by the balls.
    diagnosis
        Cause of missing triads.
    """

    ball_diameter_mm: float = 8.0
    detection: DetectionParameters = field(default_factory=DetectionParameters)
    centres: CentreParameters = field(default_factory=CentreParameters)
    search: SearchParameters = field(default_factory=SearchParameters)
    second_look: SecondLookParameters = field(default_factory=SecondLookParameters)
    variance_factor: VarianceFactorParameters = field(default_factory=VarianceFactorParameters)
    labels: LabelParameters = field(default_factory=LabelParameters)
    rig_check: RigCheckParameters = field(default_factory=RigCheckParameters)
    diagnosis: DiagnosisParameters = field(default_factory=DiagnosisParameters)


class MethodParameters(Protocol):
    """Parameters of a method of measurement, a dataclass: those of `StageMeasurer`, or of the method of 1995."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def labels(self) -> LabelParameters:
        """Labels when triads are missing."""
