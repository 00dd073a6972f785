"""Limits of a plausible calibration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CalibrationLimits:
    """Limits of a plausible calibration.

    Attributes
    ----------
    pixel_mm
        The least and the greatest width and height of a pixel, mm.
    focal_length_mm
        The least and the greatest focal length, mm.
    range_mm
        The least and the greatest depth of the control field, mm.
    baseline_mm
        The least and the greatest distance of two cameras, mm.
    usual_range_mm
        The depths at which control fields are photographed, mm: an error names the units that lead to one.
    min_extent_px
        The extent of the points of an image below which they are not pixels, px.
    border_px
        The distance outside the image that is permitted to a point, px.
    principal_point
        The offset of the principal point from the image centre above which a calibration is flagged, as a fraction of
        the width and height.
    same_shape
        The difference between the two fractions of a flagged offset below which the calibration is refused: the
        principal point is then the centre of an image of another size.
    aspect
        The deviation of the aspect of the pixels from the assumed one above which it is flagged, as a fraction of it.
    sigmas
        The number of standard deviations that such a deviation, or offset of the principal point, must also exceed.
    max_aspect_sd
        The standard deviation of the aspect up to which it counts as measured, as a fraction of it.
    rms_px
        The image RMS above which a calibration is flagged, px.
    rms_of_single
        The ratio of such an image RMS to that of each camera alone above which several shots are refused.
    baseline_sd
        The standard deviation of the baseline above which a rig is refused, as a fraction of it.
    residual_of_field
        The RMS of the reconstructed control points above which a rig is refused, as a fraction of the field's diagonal.
    doubtful
        The fraction of ``baseline_sd`` and of ``residual_of_field`` above which a calibration is flagged.
    repeated_px
        The RMS difference of all image points up to which two shots count as one, px.
    max_alternatives
        The number of other orders and pairings of the images that are tried when shots disagree.
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
