"""Parameters of the measures of a spine."""

from __future__ import annotations

from dataclasses import dataclass

from spinewatch.errors import ParameterError

LevelPair = tuple[str, str]


@dataclass(frozen=True)
class MeasureParameters:
    """Numbers of the measures, their changes and their attribution.

    Attributes
    ----------
    min_cobb_deg
        Smallest Cobb angle of a curve, degrees (SRS: 10). The largest curve is reported even when it is smaller.
    min_cobb_deviations
        Smallest Cobb angle of a curve in its standard deviations.
    tilt_roughness_deg
        Standard deviation of the third differences of the coronal tilts along a spine, degrees. A sinusoidal curve of
        Cobb 60 over seven vertebrae has third differences of up to 2.7 degrees.
    offset_roughness_mm
        Standard deviation of the third differences of the lateral displacements along a spine, mm.
    reselection_deviations
        How many standard deviations its tilt must exceed those of others, apart from theirs, for an end vertebra to be
        selected again.
    kyphosis, lordosis
        Pairs of vertebrae, cranial first. The first pair is always reported, the others where the spine has them.
    max_azimuth_sd_deg
        Largest standard deviation of the plane of maximum curvature with which the plane is reported, degrees: that of
        a vector as many of its standard deviations long, if its errors were alike in all directions.
    """

    min_cobb_deg: float = 10.0
    min_cobb_deviations: float = 2.0
    tilt_roughness_deg: float = 3.0
    offset_roughness_mm: float = 3.0
    reselection_deviations: float = 1.0
    kyphosis: tuple[LevelPair, ...] = (("T5", "T12"), ("T2", "T12"), ("T10", "L2"))
    lordosis: tuple[LevelPair, ...] = (("L1", "L5"), ("L1", "S1"))
    max_azimuth_sd_deg: float = 20.0

    def __post_init__(self) -> None:
        """Refuse numbers that the method is not defined for."""
        for name in ("min_cobb_deg", "min_cobb_deviations", "reselection_deviations"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise ParameterError(f"{name} is {getattr(self, name)}; give a number that is not negative")
        for name in ("tilt_roughness_deg", "offset_roughness_mm"):
            if not 0 < getattr(self, name) < float("inf"):
                raise ParameterError(f"{name} is {getattr(self, name)}; give a positive number")
        if not 0 < self.max_azimuth_sd_deg <= 29:
            raise ParameterError(
                f"max_azimuth_sd_deg is {self.max_azimuth_sd_deg}; give a number above 0 and up to 29, beyond"
                " which a 95% interval of the plane covers every direction"
            )
