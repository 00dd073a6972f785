"""Parameters of the solution of cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from spinewatch.calibration.solve.blunders import BlunderParameters
from spinewatch.calibration.solve.determinability import DeterminabilityParameters
from spinewatch.calibration.solve.dlt import DltParameters
from spinewatch.calibration.solve.initial_values import InitialValueParameters


@dataclass(frozen=True)
class SolveParameters:
    """How cameras are solved.

    Attributes
    ----------
    free
        Names of the adjusted parameters; None to select them by determinability and Akaike's criterion.
    fixed
        Values of parameters that are known.
    estimate_aspect
        Whether py/px is adjusted.
    check_orientation
        Whether boards upside down and exchanged sides of a stereo pair are refused.
    max_rms_of_width
        Image RMS above which a fit is refused, as a fraction of the image width.
    sufficient_rms_px
        Image RMS below which no further initial values are tried, px, ...
    sufficient_focal_sd
        ... if the standard deviation of f is also below this fraction of it.
    robust_px
        Scale of Cauchy's loss when initial values are compared, px.
    dlt
        The direct linear transformation.
    initial_values
        Interior orientations that are tried.
    determinability
        When a parameter counts as determined.
    blunders
        When a point counts as a blunder.
    """

    free: tuple[str, ...] | None = None
    fixed: Mapping[str, float] = field(default_factory=dict)
    estimate_aspect: bool = False
    check_orientation: bool = True
    max_rms_of_width: float = 0.003
    sufficient_rms_px: float = 0.5
    sufficient_focal_sd: float = 0.005
    robust_px: float = 0.5
    dlt: DltParameters = field(default_factory=DltParameters)
    initial_values: InitialValueParameters = field(default_factory=InitialValueParameters)
    determinability: DeterminabilityParameters = field(default_factory=DeterminabilityParameters)
    blunders: BlunderParameters = field(default_factory=BlunderParameters)
