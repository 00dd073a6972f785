"""Parameters of the labels of triads."""

from __future__ import annotations

from dataclasses import dataclass, field

from spinewatch.triads.spacing import SpacingParameters


@dataclass(frozen=True)
class LabelParameters:
    """How labels are assigned when triads are missing, and how they are checked.

    Attributes
    ----------
    spacing_sd
        Relative standard deviation of the distance between neighbours.
    min_likelihood_ratio
        How many times more likely the best assignment must be than the second one.
    distance_sd_mm
        Standard deviation of the change of a distance between neighbours since the known configuration (H4), mm.
    rotation_sd_deg
        Standard deviation of the change of the rotation between neighbours since then, degrees.
    max_rotation_sigma
        Changes of rotation are limited to this many standard deviations, since a marker may have been clamped again.
    max_sigma
        RMS change per pair of neighbours, in standard deviations, beyond which no assignment is accepted.
    max_assignments
        Number of assignments beyond which none is tried.
    max_axis_angle_deg
        Largest angle between the given spine axis and the line along which the triads lie, degrees.
    min_axis_margin_deg
        Least angle of that line from 45 degrees to the axes for which the order along the axis "auto" is determined,
        degrees, if it differs between the axes.
    max_chance_false
        Largest chance of being false with which a doubtful triad keeps its place among the others.
    spacing
        Distances between the triads of neighbouring vertebrae.
    """

    spacing_sd: float = 0.12
    min_likelihood_ratio: float = 100.0
    distance_sd_mm: float = 3.0
    rotation_sd_deg: float = 8.0
    max_rotation_sigma: float = 4.0
    max_sigma: float = 5.0
    max_assignments: int = 20_000
    max_axis_angle_deg: float = 60.0
    min_axis_margin_deg: float = 5.0
    max_chance_false: float = 0.5
    spacing: SpacingParameters = field(default_factory=SpacingParameters)
