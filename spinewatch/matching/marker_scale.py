"""Scale of the markers: measured over known distances between their balls.

A rotation of a camera about the vertical of the image and a change of the base displace ball images along the epipolar
lines. The points stay on them, but every marker is measured too large or too small: by 0.9% of its size for 0.3 degrees
on the large rig. A shift towards the field of a millimetre changes the scale by less than it can be measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erfc, sqrt

import numpy as np


@dataclass(frozen=True)
class MarkerScaleParameters:
    """Limits and prior knowledge of the scale.

    Attributes
    ----------
    marker_sd_mm
        Standard deviation of each known distance between two balls of a marker, mm: how exactly the markers were made
        or measured.
    calibration_sd
        Standard deviation of the scale that a sound calibration leaves; 0.0005 to 0.0018 with peg boards.
    max_p_value
        P-value below which the scale is flagged: probability to flag a sound stage.
    min_distances
        Smallest number of distances for a scale: six are two markers.
    """

    marker_sd_mm: float = 0.05
    calibration_sd: float = 0.0008
    max_p_value: float = 0.005
    min_distances: int = 6


@dataclass(frozen=True)
class MarkerScale:
    """Scale of the markers of one or more stages.

    Attributes
    ----------
    distances
        Number of distances.
    scale
        Measured over known size; 1 without a drift.
    sd
        Its standard deviation from the centres of the ball images, which differ from stage to stage.
    common_sd
        Its standard deviation from the manufacture of the markers and from the calibration, which are the same in all
        stages of a calibration.
    p_value
        Probability of this or a larger deviation from 1 without a drift.
    drifted
        Whether the p-value is below the limit.
    yaw_deg
        Rotation of the right camera about the vertical of its image that alone would explain the scale, degrees.
    base_mm
        Change of the base that alone would explain it, mm.
    """

    distances: int
    scale: float
    sd: float
    common_sd: float
    p_value: float
    drifted: bool
    yaw_deg: float
    base_mm: float

    @property
    def total_sd(self) -> float:
        """Standard deviation of the scale from all causes."""
        return float(np.hypot(self.sd, self.common_sd))

    @property
    def message(self) -> str:
        """Description of a drift, with what would explain it; yaw and base are proportional to it."""
        relative_sd = self.total_sd / max(abs(self.scale - 1), self.total_sd)
        yaw_deg = abs(self.yaw_deg)
        return (
            f"markers measured {self.scale:.4f} ± {self.total_sd:.4f} of their size: if it was that alone, the right"
            f" camera was rotated about the vertical by {yaw_deg:.2f} ± {yaw_deg * relative_sd:.2f} degrees, or the"
            f" base changed by {self.base_mm:+.1f} ± {abs(self.base_mm) * relative_sd:.1f} mm"
        )


def pooled_scale(
    scales: Sequence[MarkerScale], parameters: MarkerScaleParameters | None = None
) -> MarkerScale | None:
    """Return the scale of the markers over several stages of one calibration.

    The deviation from the ball images decreases with the number of stages. That from manufacture and calibration stays,
    since the markers and the calibration are the same.

    Parameters
    ----------
    scales
        Scale of each stage.
    parameters
        Limit of the p-value; the default one if None.

    Returns
    -------
    MarkerScale or None
        Weighted mean; None without stages.

    Examples
    --------
    >>> one = MarkerScale(12, 0.995, 0.002, 0.001, 0.03, False, -0.15, 2.1)
    >>> found = pooled_scale([one] * 4)
    >>> found.distances, round(found.sd, 4), found.common_sd, found.drifted
    (48, 0.001, 0.001, True)
    """
    if not scales:
        return None
    weights = np.array([1 / max(s.sd, 1e-9) ** 2 for s in scales])
    sd = float(1 / np.sqrt(weights.sum()))
    weights /= weights.sum()
    scale, common_sd, yaw, base = (
        float(weights @ [getattr(s, name) for s in scales])
        for name in ("scale", "common_sd", "yaw_deg", "base_mm")
    )
    p_value = erfc(abs(scale - 1) / float(np.hypot(sd, common_sd)) / sqrt(2))
    return MarkerScale(
        distances=sum(s.distances for s in scales),
        scale=scale,
        sd=sd,
        common_sd=common_sd,
        p_value=p_value,
        drifted=p_value < (parameters or MarkerScaleParameters()).max_p_value,
        yaw_deg=yaw,
        base_mm=base,
    )
