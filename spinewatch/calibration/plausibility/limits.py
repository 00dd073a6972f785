"""Limits of a plausible calibration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlausibilityParameters:
    """Limits of a plausible calibration.

    Attributes
    ----------
    pixel_mm
        Least and greatest width and height of a pixel, mm.
    focal_length_mm
        Least and greatest focal length, mm.
    range_mm
        Least and greatest depth of the control field, mm.
    baseline_mm
        Least and greatest distance of two cameras, mm.
    usual_range_mm
        Depths at which control fields are photographed: a unit that leads to one is named in the error, mm.
    min_extent_px
        Extent of the points of an image below which they are not pixels, px.
    border_px
        Distance of a point outside the image that is permitted, px.
    principal_point
        Greatest offset of the principal point from the image centre, as a fraction of the width and height; beyond
        it the calibration is flagged, ...
    same_shape
        ... and refused if the fractions differ by less than this: it is the centre of an image of another size.
    aspect
        Deviation of the aspect of the pixels from the assumed one that is flagged, as a fraction of it, ...
    sigmas
        ... if it also exceeds this number of standard deviations. Also for the principal point.
    max_aspect_sd
        Standard deviation of the aspect up to which it counts as measured, as a fraction of it.
    rms_px
        Image RMS above which a calibration is flagged, px, and several shots are refused ...
    rms_of_single
        ... if it is also this many times the RMS of each camera alone.
    baseline_sd
        Standard deviation of the baseline above which a rig is refused, as a fraction of it.
    residual_of_field
        RMS of the reconstructed control points above which a rig is refused, as a fraction of the field's diagonal.
    doubtful
        Fraction of the last two limits above which the calibration is flagged.
    repeated_px
        RMS difference of all image points up to which two shots count as one, px.
    max_alternatives
        Number of other orders and pairings of the images that are tried when shots disagree.
    """

    pixel_mm: tuple[float, float] = (0.0005, 0.1)
    focal_length_mm: tuple[float, float] = (1.0, 500.0)
    range_mm: tuple[float, float] = (100.0, 20000.0)
    baseline_mm: tuple[float, float] = (50.0, 5000.0)
    usual_range_mm: tuple[float, float] = (300.0, 3000.0)
    min_extent_px: float = 2.0
    border_px: float = 1.0
    principal_point: float = 0.15
    same_shape: float = 0.1
    aspect: float = 0.01
    sigmas: float = 4.0
    max_aspect_sd: float = 0.01
    rms_px: float = 0.5
    rms_of_single: float = 5.0
    baseline_sd: float = 0.05
    residual_of_field: float = 0.01
    doubtful: float = 0.2
    repeated_px: float = 0.15
    max_alternatives: int = 20
